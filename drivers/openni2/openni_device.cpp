#include "drivers/openni2/openni_device.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/openni2/api_thread.h"
#include "drivers/openni2/departures.h"

namespace grapnel {
namespace {

constexpr int kWait_ms = 20;
// After a pause both streams may have a frame ready, and each a second one on its way.
constexpr int kFramesPerPump = 4;

std::string serial_of(openni::Device& device) {
  std::array<char, 64> text{};
  int bytes = static_cast<int>(text.size()) - 1;
  if (device.getProperty(ONI_DEVICE_PROPERTY_SERIAL_NUMBER, text.data(), &bytes) !=
      openni::STATUS_OK) {
    return {};
  }
  return text.data();
}

std::string library_error() {
  std::string text = openni::OpenNI::getExtendedError();
  while (!text.empty() && (text.back() == '\n' || text.back() == '\t')) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// True when the images are the right way round afterwards.
bool unmirror(openni::VideoStream& stream) {
  stream.setMirroringEnabled(false);
  return !stream.getMirroringEnabled();
}

/// 0.001 m, or what the format says.
double metres_per_unit(const openni::VideoStream& depth) {
  return depth.getVideoMode().getPixelFormat() == openni::PIXEL_FORMAT_DEPTH_100_UM ? 0.0001
                                                                                    : 0.001;
}

}  // namespace

OpenNiDevice::OpenNiDevice(OpenNiOptions options)
    : options_(std::move(options)),
      pairing_(options_.color, [](FrameExchange::Slot& slot, const std::vector<Rgb8>& color) {
        std::copy(color.begin(), color.end(), slot.color.begin());
      }) {}

Status OpenNiDevice::refuse(Code code, std::string problem) {
  problem_ = std::move(problem);
  const std::string said = library_error();
  if (!said.empty()) problem_ += " (OpenNI: " + said + ")";
  return Error{code, Stage::Capture, 0};
}

Result<CameraInfo> OpenNiDevice::open(const std::string& serial) {
  if (!openni_is_up()) return refuse(Code::SensorNotConnected, "OpenNI does not start").error();
  watch_departures();
  Status done = find(serial);
  if (done) done = prepare_depth();
  if (!done) return done.error();
  if (options_.color) prepare_color();
  if (has_color_ && !unmirror(color_)) {
    return refuse(Code::SensorNotConnected, name_ + " mirrors its colour image and won't stop")
        .error();
  }
  return describe();
}

Status OpenNiDevice::find(const std::string& serial) {
  openni::Array<openni::DeviceInfo> devices;
  openni::OpenNI::enumerateDevices(&devices);
  std::string other;
  for (int i = 0; i < devices.getSize(); ++i) {
    uri_ = devices[i].getUri();
    if (!options_.uri.empty() && options_.uri != uri_) continue;
    departures_ = departures_of(uri_);
    if (device_.open(uri_.c_str()) != openni::STATUS_OK) continue;
    serial_ = serial_of(device_);
    name_ = devices[i].getName();
    if (serial.empty() || serial == serial_) return {};
    other = serial_;
    device_.close();
  }
  if (!other.empty()) {
    return refuse(Code::WrongSerial, "serial " + serial + " is wanted, " + other + " is there");
  }
  if (devices.getSize() > 0 && options_.uri.empty()) {
    return refuse(Code::SensorNotConnected, "a device is connected that can't be opened");
  }
  return refuse(Code::SensorNotConnected, options_.uri.empty()
                                              ? std::string("OpenNI finds no device")
                                              : "OpenNI finds no device " + options_.uri);
}

bool OpenNiDevice::set_mode(openni::VideoStream& stream, openni::SensorType sensor,
                            const std::vector<openni::PixelFormat>& formats) {
  const openni::SensorInfo* const info = device_.getSensorInfo(sensor);
  if (info == nullptr) return false;
  const openni::Array<openni::VideoMode>& modes = info->getSupportedVideoModes();
  for (const openni::PixelFormat format : formats) {
    for (int i = 0; i < modes.getSize(); ++i) {
      const openni::VideoMode& mode = modes[i];
      if (mode.getResolutionX() != options_.width || mode.getResolutionY() != options_.height ||
          mode.getFps() != options_.rate_hz || mode.getPixelFormat() != format) {
        continue;
      }
      if (stream.setVideoMode(mode) == openni::STATUS_OK) return true;
    }
  }
  return false;
}

Status OpenNiDevice::prepare_depth() {
  if (depth_.create(device_, openni::SENSOR_DEPTH) != openni::STATUS_OK) {
    return refuse(Code::SensorNotConnected, name_ + " has no depth stream");
  }
  if (!set_mode(depth_, openni::SENSOR_DEPTH,
                {openni::PIXEL_FORMAT_DEPTH_1_MM, openni::PIXEL_FORMAT_DEPTH_100_UM})) {
    return refuse(Code::SensorNotConnected, name_ + " has no depth of " +
                                                std::to_string(options_.width) + " x " +
                                                std::to_string(options_.height) + " at " +
                                                std::to_string(options_.rate_hz) + " Hz");
  }
  if (!unmirror(depth_)) {
    return refuse(Code::SensorNotConnected, name_ + " mirrors its depth image and won't stop");
  }
  return {};
}

void OpenNiDevice::prepare_color() {
  has_color_ =
      device_.hasSensor(openni::SENSOR_COLOR) &&
      device_.isImageRegistrationModeSupported(openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR) &&
      device_.setImageRegistrationMode(openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR) ==
          openni::STATUS_OK &&
      device_.getImageRegistrationMode() == openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR &&
      color_.create(device_, openni::SENSOR_COLOR) == openni::STATUS_OK &&
      set_mode(color_, openni::SENSOR_COLOR, {openni::PIXEL_FORMAT_RGB888});
  if (has_color_) device_.setDepthColorSyncEnabled(true);
}

CameraInfo OpenNiDevice::describe() const {
  CameraInfo info;
  info.driver = "openni2";
  info.model = name_;
  info.serial = serial_;
  const double width = options_.width;
  const double height = options_.height;
  // As OpenNI turns pixels into points: the centre between the two middle pixels' far edges.
  info.intrinsics = {options_.width,
                     options_.height,
                     0.5 * width / std::tan(0.5 * double{depth_.getHorizontalFieldOfView()}),
                     0.5 * height / std::tan(0.5 * double{depth_.getVerticalFieldOfView()}),
                     0.5 * width,
                     0.5 * height};
  if (options_.fx > 0.0) {
    info.intrinsics = {options_.width, options_.height, options_.fx,
                       options_.fy,    options_.cx,     options_.cy};
  }
  info.metres_per_unit = metres_per_unit(depth_);
  info.baseline_m = options_.baseline_m;
  info.nominal_rate_hz = options_.rate_hz;
  info.has_color = has_color_;
  return info;
}

Status OpenNiDevice::start(FrameExchange& exchange, std::uint64_t generation) {
  generation_ = generation;
  pairing_.begin(exchange);
  streaming_ = true;
  if (depth_.start() != openni::STATUS_OK || (has_color_ && color_.start() != openni::STATUS_OK)) {
    return refuse(Code::SensorNotConnected, "the streams don't start");
  }
  return {};
}

Status OpenNiDevice::pump() {
  if (departures_of(uri_) != departures_) {
    return refuse(Code::SensorNotConnected, name_ + " was disconnected");
  }
  if (!streaming_) {
    clock_.sleep_until_us(clock_.now_us() + kWait_ms * 1000);
    return {};
  }
  std::array<openni::VideoStream*, 2> streams = {&depth_, &color_};
  for (int i = 0; i < kFramesPerPump; ++i) {
    int ready = -1;
    const openni::Status waited = openni::OpenNI::waitForAnyStream(
        streams.data(), has_color_ ? 2 : 1, &ready, i == 0 ? kWait_ms : 0);
    if (waited != openni::STATUS_OK || ready < 0) break;
    take_frame(ready);
  }
  pairing_.tick(clock_.now_us());
  return {};
}

void OpenNiDevice::take_frame(int stream) {
  openni::VideoFrameRef frame;
  openni::VideoStream& source = stream == 0 ? depth_ : color_;
  if (source.readFrame(&frame) != openni::STATUS_OK || !frame.isValid() || !fits(frame)) return;
  if (stream == 0) {
    take_depth(frame);
  } else {
    take_color(frame);
  }
}

bool OpenNiDevice::fits(const openni::VideoFrameRef& frame) const {
  return frame.getWidth() == options_.width && frame.getHeight() == options_.height &&
         !frame.getCroppingEnabled();
}

void OpenNiDevice::take_depth(const openni::VideoFrameRef& frame) {
  SensorStamp stamp;
  stamp.device_us = static_cast<std::int64_t>(frame.getTimestamp());
  stamp.arrival_us = clock_.now_us();
  stamp.index = static_cast<std::uint64_t>(frame.getFrameIndex());
  stamp.generation = generation_;
  FrameExchange::Slot* const slot = pairing_.depth_arrives(stamp);
  if (slot == nullptr) return;
  const auto* bytes = static_cast<const std::uint8_t*>(frame.getData());
  for (int v = 0; v < options_.height; ++v) {
    const auto* row = reinterpret_cast<const std::uint16_t*>(
        bytes + static_cast<std::ptrdiff_t>(v) * frame.getStrideInBytes());
    std::copy(row, row + options_.width,
              slot->depth.begin() + static_cast<std::ptrdiff_t>(v) * options_.width);
  }
  pairing_.depth_ready();
}

void OpenNiDevice::take_color(const openni::VideoFrameRef& frame) {
  const auto pixels =
      static_cast<std::size_t>(options_.width) * static_cast<std::size_t>(options_.height);
  if (frame.getStrideInBytes() != options_.width * 3) return;
  pairing_.color_arrives(static_cast<const Rgb8*>(frame.getData()), pixels,
                         static_cast<std::int64_t>(frame.getTimestamp()), 0);
}

void OpenNiDevice::stop() noexcept {
  if (!streaming_) return;
  streaming_ = false;
  depth_.stop();
  if (has_color_) color_.stop();
  pairing_.end();
}

void OpenNiDevice::close() noexcept {
  stop();
  depth_.destroy();
  color_.destroy();
  device_.close();
  has_color_ = false;
}

std::vector<std::string> list_openni_devices() {
  std::vector<std::string> lines;
  if (!openni_is_up()) return lines;
  openni::Array<openni::DeviceInfo> devices;
  openni::OpenNI::enumerateDevices(&devices);
  for (int i = 0; i < devices.getSize(); ++i) {
    openni::Device device;
    if (device.open(devices[i].getUri()) != openni::STATUS_OK) continue;
    const std::string serial = serial_of(device);
    lines.push_back((serial.empty() ? "-" : serial) + " " + devices[i].getName());
    device.close();
  }
  return lines;
}

}  // namespace grapnel
