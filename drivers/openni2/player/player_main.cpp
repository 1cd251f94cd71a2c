// Plays an .oni file forward, once, every frame, as records on standard output. Alone in its
// process: the library's player crashes and hangs at random. It never seeks (the library crashes),
// reads all streams (else frames of the others are lost), trusts no frame count of a file that was
// not closed, takes silence for the end, and leaves without tidying up (that can deadlock).
#include <OpenNI.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "drivers/oni/oni_wire.h"

namespace {

using grapnel::OniHead;
using grapnel::OniKind;
using grapnel::OniRecord;

constexpr float kAsFastAsRead = -1.0F;
constexpr int kWait_ms = 500;
constexpr int kSilentWaits = 4;

void write_all(const void* data, std::size_t bytes) {
  const auto* from = static_cast<const std::uint8_t*>(data);
  while (bytes > 0) {
    const ssize_t written = ::write(STDOUT_FILENO, from, bytes);
    if (written <= 0) ::_exit(1);
    from += written;
    bytes -= static_cast<std::size_t>(written);
  }
}

void write_record(OniKind kind, const void* data, std::size_t bytes, std::int64_t time_us = 0,
                  std::int64_t index = 0) {
  const OniRecord record{kind, static_cast<std::uint32_t>(bytes), time_us, index};
  write_all(&record, sizeof record);
  write_all(data, bytes);
}

/// Before the head is out it goes out empty.
[[noreturn]] void give_up(const std::string& why, bool head_is_out) {
  if (!head_is_out) {
    const OniHead empty;
    write_all(&empty, sizeof empty);
  }
  write_record(OniKind::Problem, why.data(), why.size());
  ::_exit(1);
}

class Player {
 public:
  void open(const char* file) {
    if (openni::OpenNI::initialize() != openni::STATUS_OK) give_up("OpenNI does not start", false);
    if (device_.open(file) != openni::STATUS_OK || !device_.isFile()) {
      give_up("is not a recording that OpenNI can play", false);
    }
    playback_ = device_.getPlaybackControl();
    if (playback_ == nullptr) give_up("is not a recording that OpenNI can play", false);
    playback_->setRepeatEnabled(false);
    playback_->setSpeed(kAsFastAsRead);
    if (depth_.create(device_, openni::SENSOR_DEPTH) != openni::STATUS_OK) {
      give_up("holds no depth", false);
    }
    has_color_stream_ = device_.hasSensor(openni::SENSOR_COLOR) &&
                        color_.create(device_, openni::SENSOR_COLOR) == openni::STATUS_OK;
  }

  void begin() {
    const openni::VideoMode mode = depth_.getVideoMode();
    const openni::VideoMode color = color_.isValid() ? color_.getVideoMode() : openni::VideoMode();
    head_.width = mode.getResolutionX();
    head_.height = mode.getResolutionY();
    head_.rate_hz = mode.getFps();
    head_.horizontal_fov_rad = static_cast<double>(depth_.getHorizontalFieldOfView());
    head_.vertical_fov_rad = static_cast<double>(depth_.getVerticalFieldOfView());
    const openni::PixelFormat format = mode.getPixelFormat();
    if (format != openni::PIXEL_FORMAT_DEPTH_1_MM && format != openni::PIXEL_FORMAT_DEPTH_100_UM) {
      give_up("its depth is not in millimetres", false);
    }
    head_.metres_per_unit = format == openni::PIXEL_FORMAT_DEPTH_100_UM ? 0.0001 : 0.001;
    has_color_ = has_color_stream_ && color.getPixelFormat() == openni::PIXEL_FORMAT_RGB888 &&
                 color.getResolutionX() == head_.width && color.getResolutionY() == head_.height;
    head_.has_color = has_color_ ? 1 : 0;
    head_.depth_frames = playback_->getNumberOfFrames(depth_);
    color_frames_ = has_color_stream_ ? playback_->getNumberOfFrames(color_) : 0;
    write_all(&head_, sizeof head_);
    if (depth_.start() != openni::STATUS_OK ||
        (has_color_stream_ && color_.start() != openni::STATUS_OK)) {
      give_up("its streams don't start", true);
    }
  }

  void play() {
    std::array<openni::VideoStream*, 2> streams = {&depth_, &color_};
    int silent = 0;
    while (silent < kSilentWaits && !complete()) {
      int ready = -1;
      const openni::Status waited = openni::OpenNI::waitForAnyStream(
          streams.data(), has_color_stream_ ? 2 : 1, &ready, kWait_ms);
      if (waited != openni::STATUS_OK || ready < 0) {
        ++silent;
        continue;
      }
      silent = 0;
      take(ready);
    }
    if (depth_read_ == 0) {
      give_up("none of its frames can be played; its driver recorded no cropping", true);
    }
    write_record(OniKind::End, nullptr, 0);
  }

 private:
  /// Only a file that was closed knows how many frames it has.
  [[nodiscard]] bool complete() const {
    if (head_.depth_frames < 0 || depth_read_ < head_.depth_frames) return false;
    return !has_color_stream_ || (color_frames_ >= 0 && color_read_ >= color_frames_);
  }

  void take(int stream) {
    openni::VideoFrameRef frame;
    openni::VideoStream& source = stream == 0 ? depth_ : color_;
    if (source.readFrame(&frame) != openni::STATUS_OK || !frame.isValid()) return;
    ++(stream == 0 ? depth_read_ : color_read_);
    if (stream == 1 && !has_color_) return;
    if (frame.getWidth() != head_.width || frame.getHeight() != head_.height) {
      give_up("has images of several sizes", true);
    }
    copy(frame, stream == 0 ? 2 : 3, source.getMirroringEnabled());
    write_record(stream == 0 ? OniKind::Depth : OniKind::Color, pixels_.data(), pixels_.size(),
                 static_cast<std::int64_t>(frame.getTimestamp()), frame.getFrameIndex());
  }

  /// Rows packed, the right way round.
  void copy(const openni::VideoFrameRef& frame, std::size_t pixel_bytes, bool mirrored) {
    const auto width = static_cast<std::size_t>(head_.width);
    const auto* row = static_cast<const std::uint8_t*>(frame.getData());
    pixels_.clear();
    for (int v = 0; v < head_.height; ++v, row += frame.getStrideInBytes()) {
      for (std::size_t u = 0; u < width; ++u) {
        const std::uint8_t* const pixel = row + (mirrored ? width - 1 - u : u) * pixel_bytes;
        pixels_.insert(pixels_.end(), pixel, pixel + pixel_bytes);
      }
    }
  }

  openni::Device device_;
  openni::VideoStream depth_;
  openni::VideoStream color_;
  openni::PlaybackControl* playback_ = nullptr;
  OniHead head_;
  bool has_color_stream_ = false;
  bool has_color_ = false;
  std::int64_t color_frames_ = 0;
  std::int64_t depth_read_ = 0;
  std::int64_t color_read_ = 0;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace

/// grapnel-oni-player FILE PARENT
int main(int count, char** arguments) {
  if (count != 3) return 2;
  // Nobody else ends a player that hangs when its parent is killed.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != std::atoi(arguments[2])) return 1;
  // Never destroyed.
  auto* const player = new Player;
  player->open(arguments[1]);
  player->begin();
  player->play();
  ::_exit(0);
}
