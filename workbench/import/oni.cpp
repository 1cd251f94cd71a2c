#include "workbench/import/oni.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

#include "base/input_error.h"
#include "drivers/oni/oni_reader.h"
#include "drivers/registry.h"
#include "drivers/replay/recording.h"
#include "drivers/replay/recording_writer.h"
#include "workbench/progress.h"

namespace grapnel {
namespace {

constexpr std::int64_t kLook_us = 200'000;
constexpr std::int64_t kStep_us = 500'000;

std::filesystem::path find_player() {
  for (const std::filesystem::path& folder : plugin_folders()) {
    if (std::filesystem::exists(folder / kOniPlayer)) return folder / kOniPlayer;
  }
  throw InputError(std::string(kOniPlayer) +
                   ": is not there; Grapnel was built without OpenNI 2, which reads .oni files");
}

CameraFile camera_of(const OniHead& head) {
  CameraFile camera;
  camera.width = head.width;
  camera.height = head.height;
  camera.fx = 0.5 * head.width / std::tan(0.5 * head.horizontal_fov_rad);
  camera.fy = 0.5 * head.height / std::tan(0.5 * head.vertical_fov_rad);
  camera.cx = 0.5 * head.width;
  camera.cy = 0.5 * head.height;
  camera.metres_per_unit = head.metres_per_unit;
  camera.invalid = {0.0};
  return camera;
}

/// Frames into the recording, with times that ascend.
class Writer {
 public:
  Writer(const std::filesystem::path& folder, const CameraFile& camera)
      : writer_(folder, camera),
        width_(camera.width),
        height_(camera.height),
        depth_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)),
        color_(depth_.size()) {}

  void add(const OniRecord& record, const std::vector<std::byte>& bytes) {
    const bool depth = record.kind == OniKind::Depth;
    std::int64_t& last_us = depth ? last_depth_us_ : last_color_us_;
    last_us = std::max(last_us + 1, record.time_us);
    if (depth) {
      std::memcpy(depth_.data(), bytes.data(), bytes.size());
      writer_.add_depth(last_us, {depth_.data(), width_, height_});
    } else {
      std::memcpy(color_.data(), bytes.data(), bytes.size());
      writer_.add_color(last_us, {color_.data(), width_, height_});
    }
  }
  [[nodiscard]] const RecordingWriter& writer() const { return writer_; }

 private:
  RecordingWriter writer_;
  int width_;
  int height_;
  std::vector<std::uint16_t> depth_;
  std::vector<Rgb8> color_;
  std::int64_t last_depth_us_ = -1;
  std::int64_t last_color_us_ = -1;
};

/// One frame of depth out of a played file, and the colour nearest to it.
class FrameOfOni {
 public:
  FrameOfOni(const OniHead& head, std::size_t number) : number_(number) {
    file_.camera = camera_of(head);
    file_.number = number;
    has_color_ = head.has_color != 0;
  }

  /// False once nothing that comes can change the frame.
  bool take(const OniRecord& record, const std::vector<std::byte>& bytes) {
    if (record.kind == OniKind::Depth && seen_++ == number_) {
      file_.time_us = record.time_us;
      file_.depth.resize(bytes.size() / sizeof(std::uint16_t));
      std::memcpy(file_.depth.data(), bytes.data(), bytes.size());
    }
    if (record.kind == OniKind::Color) keep(record.time_us, bytes);
    if (!complete() || !has_color_) return !complete();
    // The streams are not quite in step.
    const std::int64_t limit_us = record.kind == OniKind::Color ? kColorLimit_us : kStep_us;
    return record.time_us <= file_.time_us + limit_us;
  }
  [[nodiscard]] bool complete() const { return seen_ > number_; }
  [[nodiscard]] std::size_t seen() const { return seen_; }
  [[nodiscard]] FrameFile finish() {
    std::int64_t nearest_us = kColorLimit_us + 1;
    for (Color& color : colors_) {
      const std::int64_t off_us = std::abs(color.time_us - file_.time_us);
      if (off_us >= nearest_us) continue;
      nearest_us = off_us;
      file_.color = std::move(color.pixels);
    }
    return std::move(file_);
  }

 private:
  struct Color {
    std::int64_t time_us = 0;
    std::vector<Rgb8> pixels;
  };

  void keep(std::int64_t time_us, const std::vector<std::byte>& bytes) {
    constexpr std::size_t kSlack = 4;  // frames that colour may be ahead of depth
    if (!complete() && colors_.size() == kSlack) colors_.erase(colors_.begin());
    Color& color = colors_.emplace_back();
    color.time_us = time_us;
    color.pixels.resize(bytes.size() / sizeof(Rgb8));
    std::memcpy(color.pixels.data(), bytes.data(), bytes.size());
  }

  FrameFile file_;
  std::size_t number_;
  std::size_t seen_ = 0;
  std::vector<Color> colors_;
  bool has_color_ = false;
};

}  // namespace

bool is_oni(const std::filesystem::path& file) { return file.extension() == ".oni"; }

OniImport import_oni(const std::filesystem::path& file, const std::filesystem::path& folder,
                     const std::optional<std::string>& camera_file, bool with_color) {
  OniReader reader(find_player(), file);
  OniImport done;
  done.camera = camera_file ? read_camera_file(*camera_file) : camera_of(reader.head());
  done.camera_origin = camera_file ? *camera_file : std::string("the file's fields of view");
  if (done.camera.width != reader.head().width || done.camera.height != reader.head().height) {
    throw InputError(file.string() + ": " + std::to_string(reader.head().width) + " by " +
                     std::to_string(reader.head().height) + " pixels; the camera has " +
                     std::to_string(done.camera.width) + " by " +
                     std::to_string(done.camera.height));
  }
  done.camera.metres_per_unit = reader.head().metres_per_unit;
  Writer writer(folder, done.camera);
  const std::int64_t announced = std::max<std::int64_t>(reader.head().depth_frames, 0);
  Progress progress("import", static_cast<std::size_t>(announced));
  std::vector<std::byte> bytes;
  for (;;) {
    const std::optional<OniRecord> record = reader.next(kLook_us, bytes);
    if (!record) continue;
    if (record->kind == OniKind::End) break;
    if (record->kind == OniKind::Color && !with_color) continue;
    writer.add(*record, bytes);
    if (record->kind == OniKind::Depth) progress.step();
  }
  done.frames = writer.writer().depth_images();
  done.colors = writer.writer().color_images();
  const auto expected = static_cast<std::size_t>(announced);
  done.left_out = expected > done.frames ? expected - done.frames : 0;
  return done;
}

FrameFile read_oni_frame(const std::filesystem::path& file, std::size_t number) {
  OniReader reader(find_player(), file);
  FrameOfOni wanted(reader.head(), number);
  std::vector<std::byte> bytes;
  for (;;) {
    const std::optional<OniRecord> record = reader.next(kLook_us, bytes);
    if (!record) continue;
    if (record->kind == OniKind::End || !wanted.take(*record, bytes)) break;
  }
  if (!wanted.complete()) {
    throw InputError(file.string() + ": there is no frame " + std::to_string(number) + "; 0 to " +
                     std::to_string(wanted.seen() - 1) + " are there");
  }
  return wanted.finish();
}

}  // namespace grapnel
