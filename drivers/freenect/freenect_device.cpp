#include "drivers/freenect/freenect_device.h"

#include <sys/time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

namespace grapnel {
namespace {

// libfreenect's cameras.c: data bytes of a packet and of a raw frame, 11 bits a pixel and Bayer.
constexpr std::size_t kDepthPacket = 1748;
constexpr std::size_t kColorPacket = 1908;
constexpr std::size_t kDepthRaw = kKinectPixels * 11 / 8;
constexpr std::size_t kColorRaw = kKinectPixels;
// All ones is 2047 in each pixel, the sensor's own "no reading".
constexpr std::uint8_t kNoReading = 0xff;
constexpr std::uint8_t kBlack = 0;

constexpr std::uint32_t kTicksPerUs = 60;
constexpr suseconds_t kPump_us = 20'000;
constexpr double kRate_hz = 30.0;
// Nominal colour camera of the Kinect v1, used for registered depth (ROS openni_camera).
constexpr double kColorFocal_px = 525.0;
constexpr double kColorCentreU_px = 319.5;
constexpr double kColorCentreV_px = 239.5;

constexpr int kUsbNoDevice = -4;
constexpr int kUsbInterrupted = -10;

// The log callback is given no pointer of ours; a device's calls all come from one thread.
thread_local FreenectDevice* logging_device = nullptr;

FreenectDevice* device_of(freenect_device* device) {
  return static_cast<FreenectDevice*>(freenect_get_user(device));
}

std::vector<std::string> serials_of(freenect_context* context) {
  std::vector<std::string> serials;
  freenect_device_attributes* list = nullptr;
  if (freenect_list_device_attributes(context, &list) < 0) return serials;
  for (const freenect_device_attributes* unit = list; unit != nullptr; unit = unit->next) {
    serials.emplace_back(unit->camera_serial);
  }
  freenect_free_device_attributes(list);
  return serials;
}

}  // namespace

FreenectDevice::FreenectDevice(FreenectOptions options)
    : options_(std::move(options)),
      pairing_(options_.color, [this](FrameExchange::Slot& slot,
                                      const std::vector<Rgb8>& color) { attach(slot, color); }),
      depth_clock_(kTicksPerUs),
      depth_raw_(kDepthPacket, kDepthRaw, kNoReading),
      color_raw_(kColorPacket, kColorRaw, kBlack) {}

Status FreenectDevice::refuse(Code code, std::string problem) {
  problem_ = std::move(problem);
  if (!complaint_.empty()) problem_ += " (libfreenect: " + complaint_ + ")";
  return Error{code, Stage::Capture, 0};
}

Result<CameraInfo> FreenectDevice::open(const std::string& serial) {
  logging_device = this;
  if (freenect_init(&context_, nullptr) < 0) {
    context_ = nullptr;
    return refuse(Code::SensorNotConnected, "USB can't be used").error();
  }
  freenect_set_log_callback(context_, &FreenectDevice::on_log);
  // The level at which the library says how many of a frame's packets arrived.
  freenect_set_log_level(context_, FREENECT_LOG_SPEW);
  std::string found;
  const Status opened = find_and_open(serial, found);
  if (!opened) return opened.error();
  freenect_set_user(camera_, this);
  freenect_set_depth_callback(
      camera_, [](freenect_device* device, void* pixels, std::uint32_t ticks) {
        device_of(device)->on_depth(static_cast<const std::uint16_t*>(pixels), ticks);
      });
  freenect_set_video_callback(
      camera_, [](freenect_device* device, void* pixels, std::uint32_t ticks) {
        device_of(device)->on_color(static_cast<const Rgb8*>(pixels), ticks);
      });
  freenect_set_depth_chunk_callback(
      camera_, [](void* frame, void* data, int number, int bytes, void* self) {
        static_cast<FreenectDevice*>(self)->depth_raw_.add(static_cast<std::uint8_t*>(frame),
                                                           static_cast<const std::uint8_t*>(data),
                                                           number, static_cast<std::size_t>(bytes));
      });
  freenect_set_video_chunk_callback(
      camera_, [](void* frame, void* data, int number, int bytes, void* self) {
        static_cast<FreenectDevice*>(self)->color_raw_.add(static_cast<std::uint8_t*>(frame),
                                                           static_cast<const std::uint8_t*>(data),
                                                           number, static_cast<std::size_t>(bytes));
      });
  map_ = std::make_unique<RegistrationMap>(camera_);
  open_motor();
  return describe(found);
}

Status FreenectDevice::find_and_open(const std::string& serial, std::string& found) {
  const std::vector<std::string> serials = serials_of(context_);
  units_ = static_cast<std::size_t>(std::max(0, freenect_num_devices(context_)));
  if (units_ == 0) return refuse(Code::SensorNotConnected, "no Kinect is connected");
  // The library opens by place in a list that leaves out the units it may not open.
  if (serials.size() != units_) {
    return refuse(Code::SensorNotConnected,
                  "a Kinect is connected that can't be opened; is this user in the group of "
                  "60-grapnel-camera.rules?");
  }
  const auto place =
      serial.empty() ? serials.begin() : std::find(serials.begin(), serials.end(), serial);
  if (place == serials.end()) {
    return refuse(Code::WrongSerial,
                  "serial " + serial + " is wanted, " + serials.front() + " is there");
  }
  found = *place;
  freenect_select_subdevices(context_, FREENECT_DEVICE_CAMERA);
  if (freenect_open_device(context_, &camera_, static_cast<int>(place - serials.begin())) < 0) {
    // What is half open is closed with the context.
    camera_ = nullptr;
    return refuse(Code::SensorNotConnected, "Kinect " + found + " can't be opened");
  }
  const freenect_depth_format format = options_.depth == FreenectDepth::Raw ? FREENECT_DEPTH_11BIT
                                       : options_.depth == FreenectDepth::Registered
                                           ? FREENECT_DEPTH_REGISTERED
                                           : FREENECT_DEPTH_MM;
  const bool set =
      freenect_set_depth_mode(camera_,
                              freenect_find_depth_mode(FREENECT_RESOLUTION_MEDIUM, format)) >= 0 &&
      freenect_set_video_mode(
          camera_, freenect_find_video_mode(FREENECT_RESOLUTION_MEDIUM, FREENECT_VIDEO_RGB)) >= 0;
  return set ? Status() : refuse(Code::SensorNotConnected, "Kinect " + found + " takes no mode");
}

void FreenectDevice::open_motor() {
  if (units_ != 1) return;
  freenect_select_subdevices(context_, FREENECT_DEVICE_MOTOR);
  // It stays selected: the library reads the accelerometer only then.
  if (freenect_open_device(context_, &motor_, 0) < 0) motor_ = nullptr;
  // What the library said of a motor that is not there concerns nobody.
  gone_ = false;
  complaint_.clear();
}

CameraInfo FreenectDevice::describe(const std::string& serial) const {
  CameraInfo info;
  info.driver = "freenect";
  info.model = motor_ != nullptr ? "Kinect v1" : "Kinect v1, tilt unknown";
  info.serial = serial;
  info.intrinsics = map_->intrinsics();
  if (options_.depth == FreenectDepth::Registered) {
    info.intrinsics = {kKinectWidth,   kKinectHeight,    kColorFocal_px,
                       kColorFocal_px, kColorCentreU_px, kColorCentreV_px};
  }
  if (options_.fx > 0.0) {
    info.intrinsics = {kKinectWidth, kKinectHeight, options_.fx,
                       options_.fy,  options_.cx,   options_.cy};
  }
  info.metres_per_unit = options_.depth == FreenectDepth::Raw ? kFineUnit_m : 0.001;
  info.baseline_m = map_->baseline_m();
  info.nominal_rate_hz = kRate_hz;
  info.has_color = options_.color;
  return info;
}

Status FreenectDevice::start(FrameExchange& exchange, std::uint64_t generation) {
  generation_ = generation;
  pairing_.begin(exchange);
  depth_raw_.begin();
  color_raw_.begin();
  depth_packets_ = {};
  color_packets_ = {};
  streaming_ = true;
  bool started = freenect_start_depth(camera_) >= 0;
  if (options_.color) started = freenect_start_video(camera_) >= 0 && started;
  if (gone_) return refuse(Code::SensorNotConnected, "the Kinect was disconnected");
  return started ? Status() : refuse(Code::SensorNotConnected, "the streams don't start");
}

Status FreenectDevice::pump() {
  timeval limit{0, kPump_us};
  const int result = freenect_process_events_timeout(context_, &limit);
  if (gone_ || (result < 0 && result != kUsbInterrupted)) {
    return refuse(Code::SensorNotConnected, "the Kinect was disconnected");
  }
  pairing_.tick(clock_.now_us());
  return {};
}

void FreenectDevice::stop() noexcept {
  if (!streaming_) return;
  streaming_ = false;
  // Both by hand: the library's own closing stops only one of two running streams.
  freenect_stop_video(camera_);
  freenect_stop_depth(camera_);
  pairing_.end();
}

void FreenectDevice::close() noexcept {
  if (context_ == nullptr) return;
  stop();
  if (motor_ != nullptr) freenect_close_device(motor_);
  if (camera_ != nullptr) freenect_close_device(camera_);
  motor_ = nullptr;
  camera_ = nullptr;
  freenect_shutdown(context_);
  context_ = nullptr;
}

bool FreenectDevice::read_gravity(std::array<double, 3>& gravity) {
  if (motor_ == nullptr || freenect_update_tilt_state(motor_) < 0) return false;
  const freenect_raw_tilt_state* const state = freenect_get_tilt_state(motor_);
  gravity = {static_cast<double>(state->accelerometer_x) / FREENECT_COUNTS_PER_G,
             static_cast<double>(state->accelerometer_y) / FREENECT_COUNTS_PER_G,
             static_cast<double>(state->accelerometer_z) / FREENECT_COUNTS_PER_G};
  return true;
}

void FreenectDevice::on_log(freenect_context* context, freenect_loglevel level, const char* text) {
  static_cast<void>(context);
  if (logging_device != nullptr) logging_device->read_log(level, text);
}

void FreenectDevice::read_log(freenect_loglevel level, const char* text) {
  const std::string_view line(text);
  const auto packets = [&](std::string_view stream) -> Packets& {
    return line.find(stream) != std::string_view::npos ? color_packets_ : depth_packets_;
  };
  int arrived = 0;
  int expected = 0;
  // The two streams' lines, as in libfreenect's cameras.c; its other lines begin otherwise.
  if (line.starts_with("Got ") &&
      std::sscanf(text, "Got %*s frame of size %*d/%*d, %d/%d packets", &arrived, &expected) == 2) {
    Packets& of_stream = packets("video");
    of_stream.lost = static_cast<std::uint32_t>(std::max(0, expected - arrived)) + of_stream.cut;
    of_stream.cut = 0;
  } else if (line.find("] Expected ") != std::string_view::npos &&
             line.find("] Expected max") == std::string_view::npos) {
    ++packets("[Stream 80").cut;
  }
  if (level > FREENECT_LOG_ERROR) return;
  complaint_ = line.substr(0, line.find_last_not_of("\n ") + 1);
  const std::string gone = std::to_string(kUsbNoDevice);
  if (line.find("(" + gone + ")") != std::string_view::npos ||
      line.find(": " + gone) != std::string_view::npos) {
    gone_ = true;
  }
}

void FreenectDevice::fill_depth(const std::uint16_t* pixels, std::uint16_t* out) const noexcept {
  if (options_.depth == FreenectDepth::Raw) {
    std::transform(pixels, pixels + kKinectPixels, out,
                   [this](std::uint16_t raw) { return map_->fine_depth(raw); });
    return;
  }
  // The library's largest value stands for everything beyond its range.
  std::transform(pixels, pixels + kKinectPixels, out, [](std::uint16_t mm) {
    return mm < FREENECT_DEPTH_MM_MAX_VALUE ? mm : std::uint16_t{0};
  });
}

void FreenectDevice::on_depth(const std::uint16_t* pixels, std::uint32_t ticks) {
  depth_us_ = depth_clock_.time_us(ticks);
  depth_ticks_ = ticks;
  FrameExchange::Slot* const slot =
      pairing_.depth_arrives({depth_us_, clock_.now_us(), 0, depth_packets_.lost, generation_});
  if (slot != nullptr) {
    fill_depth(pixels, slot->depth.data());
    pairing_.depth_ready();
  }
  depth_raw_.next_frame();
}

void FreenectDevice::on_color(const Rgb8* pixels, std::uint32_t ticks) {
  // One counter stamps both streams.
  const auto after_depth = static_cast<std::int32_t>(ticks - depth_ticks_);
  const std::int64_t color_us = depth_us_ + after_depth / static_cast<std::int32_t>(kTicksPerUs);
  pairing_.color_arrives(pixels, kKinectPixels, color_us, color_packets_.lost);
  color_raw_.next_frame();
}

void FreenectDevice::attach(FrameExchange::Slot& slot, const std::vector<Rgb8>& color) {
  if (options_.depth == FreenectDepth::Registered) {
    std::copy(color.begin(), color.end(), slot.color.begin());
    return;
  }
  const double mm_per_unit = options_.depth == FreenectDepth::Raw ? 1e3 * kFineUnit_m : 1.0;
  map_->color_of_depth(slot.depth.data(), mm_per_unit, color.data(), slot.color.data());
}

std::vector<std::string> list_kinects() {
  freenect_context* context = nullptr;
  if (freenect_init(&context, nullptr) < 0) return {};
  freenect_set_log_level(context, FREENECT_LOG_FATAL);
  freenect_select_subdevices(context, FREENECT_DEVICE_CAMERA);
  std::vector<std::string> serials = serials_of(context);
  freenect_shutdown(context);
  return serials;
}

}  // namespace grapnel
