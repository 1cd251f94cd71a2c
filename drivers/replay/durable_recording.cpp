#include "drivers/replay/durable_recording.h"

#include "base/input_error.h"
#include "drivers/replay/recording_index.h"

namespace grapnel {
namespace {

constexpr const char* kHead = "# timestamp filename\n";

std::string index_line(std::int64_t time_us, const std::string& name) {
  return time_text(time_us) + " " + name + "\n";
}

}  // namespace

DurableRecording::DurableRecording(RecordingStore& store, const CameraFile& camera)
    : store_(&store) {
  const std::string text = camera_file_text(camera);
  store_->make_folder("depth");
  store_->write("camera.toml", std::as_bytes(std::span(text)));
  store_->append("depth.txt", kHead);
  store_->sync();
}

void DurableRecording::add(const EncodedFrame& frame) {
  const std::string stem = time_text(frame.time_us);
  const std::string depth = "depth/" + stem + ".png";
  const std::string color = "rgb/" + stem + frame.color_ending;
  store_->write(depth, frame.depth);
  if (!frame.color.empty()) {
    if (!has_color_) {
      store_->make_folder("rgb");
      store_->append("rgb.txt", kHead);
      has_color_ = true;
    }
    store_->write(color, frame.color);
    color_lines_ += index_line(frame.time_us, color);
  }
  depth_lines_ += index_line(frame.time_us, depth);
  ++waiting_;
}

void DurableRecording::flush_if_due(std::int64_t now_us) {
  if (!last_flush_us_) last_flush_us_ = now_us;
  if (now_us - *last_flush_us_ < kFlushUs) return;
  last_flush_us_ = now_us;
  flush();
}

void DurableRecording::append_lines(const char* name, std::string& lines) {
  if (lines.empty()) return;
  store_->append(name, lines);
  lines.clear();
}

void DurableRecording::flush() {
  if (waiting_ == 0) return;
  store_->sync();
  append_lines("rgb.txt", color_lines_);
  append_lines("depth.txt", depth_lines_);
  flushed_ += waiting_;
  waiting_ = 0;
  store_->sync();
}

CameraFile camera_file_of(const DepthFrame& frame, const std::string& serial) {
  CameraFile file;
  file.width = frame.depth.width;
  file.height = frame.depth.height;
  file.fx = frame.intrinsics.fx;
  file.fy = frame.intrinsics.fy;
  file.cx = frame.intrinsics.cx;
  file.cy = frame.intrinsics.cy;
  file.metres_per_unit = frame.metres_per_unit;
  file.baseline_m = frame.baseline_m;
  file.invalid = {0.0};  // a frame of the pool has no other marker
  file.serial = serial;
  file.corrected = frame.corrected;
  return file;
}

}  // namespace grapnel
