#include "drivers/replay/recording_writer.h"

#include <string>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"

namespace grapnel {
namespace {

std::string image_name(const char* folder, std::int64_t time_us, const std::string& ending) {
  return std::string(folder) + "/" + time_text(time_us) + ending;
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code) throw InputError(folder.string() + ": can't be made: " + code.message());
}

void copy_image(const std::filesystem::path& from, const std::filesystem::path& to) {
  write_file(to, read_file(from, kMaxImageFileBytes));
}

}  // namespace

RecordingWriter::RecordingWriter(std::filesystem::path folder, const CameraFile& camera)
    : folder_(std::move(folder)) {
  for (const char* name : {"depth.txt", "camera.toml"}) {
    if (std::filesystem::exists(folder_ / name)) {
      throw InputError(folder_.string() + ": holds a recording already (" + name + ")");
    }
  }
  make_folder(folder_ / "depth");
  write_file(folder_ / "camera.toml", camera_file_text(camera));
  add_line(depth_index_, "depth.txt", "# timestamp filename\n");
}

void RecordingWriter::add_line(std::ofstream& stream, const char* name, const std::string& line) {
  if (!stream.is_open()) stream.open(folder_ / name, std::ios::binary | std::ios::trunc);
  stream << line << std::flush;
  if (!stream) throw InputError((folder_ / name).string() + ": can't be written");
}

void RecordingWriter::add_depth(std::int64_t time_us, ImageView<const std::uint16_t> depth) {
  const std::string name = image_name("depth", time_us, ".png");
  write_depth_png(folder_ / name, depth);
  add_line(depth_index_, "depth.txt", time_text(time_us) + " " + name + "\n");
  ++depth_images_;
}

void RecordingWriter::add_depth_file(std::int64_t time_us, const std::filesystem::path& image) {
  const std::string name = image_name("depth", time_us, ".png");
  copy_image(image, folder_ / name);
  add_line(depth_index_, "depth.txt", time_text(time_us) + " " + name + "\n");
  ++depth_images_;
}

void RecordingWriter::begin_colors() {
  if (color_images_ > 0) return;
  make_folder(folder_ / "rgb");
  add_line(color_index_, "rgb.txt", "# timestamp filename\n");
}

void RecordingWriter::add_color(std::int64_t time_us, ImageView<const Rgb8> color) {
  begin_colors();
  const std::string name = image_name("rgb", time_us, ".png");
  write_color_png(folder_ / name, color);
  add_line(color_index_, "rgb.txt", time_text(time_us) + " " + name + "\n");
  ++color_images_;
}

void RecordingWriter::add_color_file(std::int64_t time_us, const std::filesystem::path& image) {
  begin_colors();
  const std::string name = image_name("rgb", time_us, image.extension().string());
  copy_image(image, folder_ / name);
  add_line(color_index_, "rgb.txt", time_text(time_us) + " " + name + "\n");
  ++color_images_;
}

void RecordingWriter::add_pose(const TimedPose& timed) {
  if (!poses_.is_open()) {
    add_line(poses_, "groundtruth.txt", "# timestamp tx ty tz qx qy qz qw\n");
  }
  add_line(poses_, "groundtruth.txt", pose_line(timed));
}

}  // namespace grapnel
