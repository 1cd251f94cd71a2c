// A driver inside OpenNI with one camera, steered by FakeSensor: what any maker of a depth camera
// writes for OpenNI.
#include <OpenNI.h>
#ifndef TRUE
#define TRUE 1
#define FALSE 0
#endif
#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(pointer) delete (pointer)
#include <Driver/OniDriverAPI.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tests/support/fake_openni/fake_sensor.h"

namespace {

using grapnel::test::FakeSensor;
using grapnel::test::kSensorHeight;
using grapnel::test::kSensorWidth;

constexpr auto kNap = std::chrono::milliseconds(1);
constexpr std::int64_t kPeriod_us = 33'333;
constexpr int kRate_hz = 30;

FakeSensor& sensor() {
  static FakeSensor none;
  static FakeSensor* const mapped = grapnel::test::map_fake_sensor();
  return mapped != nullptr ? *mapped : none;
}

void hang_while(const std::atomic<std::int32_t>& flag) {
  while (flag.load() != 0) std::this_thread::sleep_for(kNap);
}

std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

template <class T>
OniStatus give(const T& value, void* data, int* bytes) {
  if (*bytes < static_cast<int>(sizeof(T))) return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, &value, sizeof(T));
  *bytes = sizeof(T);
  return ONI_STATUS_OK;
}

class FakeStream final : public oni::driver::StreamBase {
 public:
  FakeStream(OniSensorType type, std::int32_t address) : type_(type), address_(address) {
    ++sensor().streams;
  }
  ~FakeStream() override {
    stop();
    --sensor().streams;
  }

  OniStatus start() override {
    hang_while(sensor().hang_start);
    if (thread_.joinable()) return ONI_STATUS_OK;
    ++sensor().running;
    stop_ = false;
    thread_ = std::thread([this] { run(); });
    return ONI_STATUS_OK;
  }
  void stop() override {
    hang_while(sensor().hang_stop);
    if (!thread_.joinable()) return;
    stop_ = true;
    thread_.join();
    --sensor().running;
  }

  OniBool isPropertySupported(int id) override {
    switch (id) {
      case ONI_STREAM_PROPERTY_CROPPING:
        return sensor().no_cropping.load() == 0 ? TRUE : FALSE;
      case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
      case ONI_STREAM_PROPERTY_VERTICAL_FOV:
      case ONI_STREAM_PROPERTY_VIDEO_MODE:
      case ONI_STREAM_PROPERTY_MAX_VALUE:
      case ONI_STREAM_PROPERTY_STRIDE:
      case ONI_STREAM_PROPERTY_MIRRORING:
        return TRUE;
      default:
        return FALSE;
    }
  }
  OniStatus getProperty(int id, void* data, int* bytes) override {
    switch (id) {
      case ONI_STREAM_PROPERTY_CROPPING:
        if (sensor().no_cropping.load() != 0) return ONI_STATUS_NOT_SUPPORTED;
        return give(OniCropping{}, data, bytes);
      case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
        return give(grapnel::test::kSensorHorizontalFov_rad, data, bytes);
      case ONI_STREAM_PROPERTY_VERTICAL_FOV:
        return give(grapnel::test::kSensorVerticalFov_rad, data, bytes);
      case ONI_STREAM_PROPERTY_VIDEO_MODE:
        return give(mode(), data, bytes);
      case ONI_STREAM_PROPERTY_MAX_VALUE:
        return give(int{10'000}, data, bytes);
      case ONI_STREAM_PROPERTY_STRIDE:
        return give(stride(), data, bytes);
      case ONI_STREAM_PROPERTY_MIRRORING:
        return give(OniBool{mirrored_ ? TRUE : FALSE}, data, bytes);
      default:
        return ONI_STATUS_NOT_SUPPORTED;
    }
  }
  OniStatus setProperty(int id, const void* data, int) override {
    if (id == ONI_STREAM_PROPERTY_MIRRORING) {
      if (sensor().stuck_mirror.load() == 0)
        mirrored_ = *static_cast<const OniBool*>(data) != FALSE;
      return ONI_STATUS_OK;
    }
    return id == ONI_STREAM_PROPERTY_VIDEO_MODE || id == ONI_STREAM_PROPERTY_CROPPING
               ? ONI_STATUS_OK
               : ONI_STATUS_NOT_SUPPORTED;
  }

  [[nodiscard]] OniVideoMode mode() const {
    OniVideoMode mode{};
    mode.pixelFormat =
        type_ == ONI_SENSOR_DEPTH ? ONI_PIXEL_FORMAT_DEPTH_1_MM : ONI_PIXEL_FORMAT_RGB888;
    mode.resolutionX = kSensorWidth;
    mode.resolutionY = kSensorHeight;
    mode.fps = kRate_hz;
    return mode;
  }

 private:
  [[nodiscard]] int stride() const { return kSensorWidth * (type_ == ONI_SENSOR_DEPTH ? 2 : 3); }

  void run() {
    const std::int64_t begin_us = now_us();
    for (std::int64_t n = 1; !stop_; ++n) {
      const std::int64_t due_us = begin_us + n * kPeriod_us / sensor().speed_up.load();
      while (!stop_ && now_us() < due_us) std::this_thread::sleep_for(kNap);
      const bool depth = type_ == ONI_SENSOR_DEPTH;
      const bool away = sensor().plugged.load() == 0 || sensor().address.load() != address_;
      if (stop_ || away || sensor().silent.load() != 0) continue;
      if (!depth && sensor().color_frozen.load() != 0) continue;
      if (depth && sensor().skip_frames.load() > 0) {
        --sensor().skip_frames;
        continue;
      }
      send(static_cast<std::uint64_t>(n), depth);
    }
  }

  void send(std::uint64_t n, bool depth) {
    OniFrame* const frame = getServices().acquireFrame();
    if (frame == nullptr) return;
    frame->frameIndex = static_cast<int>(n);
    frame->timestamp = n * kPeriod_us;
    if (!depth) frame->timestamp += static_cast<std::uint64_t>(sensor().color_skew_us.load());
    frame->videoMode = mode();
    frame->width = kSensorWidth;
    frame->height = kSensorHeight;
    frame->cropOriginX = 0;
    frame->cropOriginY = 0;
    frame->croppingEnabled = FALSE;
    frame->sensorType = type_;
    frame->stride = stride();
    for (int v = 0; v < kSensorHeight; ++v) {
      for (int u = 0; u < kSensorWidth; ++u) {
        const int from_u = mirrored_ ? kSensorWidth - 1 - u : u;
        const int pixel = v * kSensorWidth + u;
        if (depth) {
          static_cast<std::uint16_t*>(frame->data)[pixel] =
              grapnel::test::sensor_depth_mm(from_u, v, n);
        } else {
          static_cast<grapnel::Rgb8*>(frame->data)[pixel] =
              grapnel::test::sensor_color(from_u, v, n);
        }
      }
    }
    raiseNewFrame(frame);
    getServices().releaseFrame(frame);
    if (depth) ++sensor().depth_frames;
  }

  const OniSensorType type_;
  const std::int32_t address_;
  std::atomic<bool> mirrored_{true};  // as genuine devices begin
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class FakeDevice final : public oni::driver::DeviceBase {
 public:
  explicit FakeDevice(std::int32_t address) : address_(address) { ++sensor().opened; }
  ~FakeDevice() override { --sensor().opened; }

  OniStatus getSensorInfoList(OniSensorInfo** infos, int* count) override {
    modes_[0] = FakeStream(ONI_SENSOR_DEPTH, address_).mode();
    modes_[1] = FakeStream(ONI_SENSOR_COLOR, address_).mode();
    infos_[0] = {ONI_SENSOR_DEPTH, 1, &modes_[0]};
    infos_[1] = {ONI_SENSOR_COLOR, 1, &modes_[1]};
    *infos = infos_.data();
    *count = sensor().color.load() != 0 ? 2 : 1;
    return ONI_STATUS_OK;
  }
  oni::driver::StreamBase* createStream(OniSensorType type) override {
    return new FakeStream(type, address_);
  }
  void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }

  OniStatus getProperty(int id, void* data, int* bytes) override {
    if (id == ONI_DEVICE_PROPERTY_SERIAL_NUMBER) {
      const std::string serial = sensor().serial;
      if (*bytes <= static_cast<int>(serial.size())) return ONI_STATUS_BAD_PARAMETER;
      std::memcpy(data, serial.c_str(), serial.size() + 1);
      *bytes = static_cast<int>(serial.size()) + 1;
      return ONI_STATUS_OK;
    }
    if (id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION) return give(registration_, data, bytes);
    return ONI_STATUS_NOT_SUPPORTED;
  }
  OniStatus setProperty(int id, const void* data, int) override {
    if (id != ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION) return ONI_STATUS_NOT_SUPPORTED;
    registration_ = *static_cast<const OniImageRegistrationMode*>(data);
    return ONI_STATUS_OK;
  }
  OniBool isPropertySupported(int id) override {
    return id == ONI_DEVICE_PROPERTY_SERIAL_NUMBER || id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION
               ? TRUE
               : FALSE;
  }
  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode mode) override {
    return mode == ONI_IMAGE_REGISTRATION_OFF || sensor().registers.load() != 0 ? TRUE : FALSE;
  }

 private:
  const std::int32_t address_;
  OniImageRegistrationMode registration_ = ONI_IMAGE_REGISTRATION_OFF;
  std::array<OniVideoMode, 2> modes_{};
  std::array<OniSensorInfo, 2> infos_{};
};

class FakeDriver final : public oni::driver::DriverBase {
 public:
  explicit FakeDriver(OniDriverServices* services) : DriverBase(services) {}

  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    DriverBase::initialize(connected, disconnected, changed, cookie);
    look();
    sensor().driver_up = 1;
    bus_ = std::thread([this] {
      while (!stop_) {
        look();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
    return ONI_STATUS_OK;
  }
  void shutdown() override {
    stop_ = true;
    if (bus_.joinable()) bus_.join();
  }
  oni::driver::DeviceBase* deviceOpen(const char* uri, const char*) override {
    hang_while(sensor().hang_open);
    const std::lock_guard lock(mutex_);
    const bool there = present_ && std::strcmp(uri, info_.uri) == 0 && sensor().plugged.load() != 0;
    return there ? new FakeDevice(address_) : nullptr;
  }
  void deviceClose(oni::driver::DeviceBase* device) override { delete device; }

 private:
  /// Follows the plug.
  void look() {
    const bool plugged = sensor().plugged.load() != 0;
    const std::int32_t address = sensor().address.load();
    OniDeviceInfo left;
    OniDeviceInfo come;
    bool leaves = false;
    bool comes = false;
    {
      const std::lock_guard lock(mutex_);
      leaves = present_ && (!plugged || address != address_) && sensor().says_goodbye.load() != 0;
      left = info_;
      if (leaves) present_ = false;
      comes = plugged && (!present_ || address != address_);
      if (comes) {
        info_ = {};
        std::snprintf(info_.uri, sizeof(info_.uri), "fake://1/%d", static_cast<int>(address));
        std::snprintf(info_.vendor, sizeof(info_.vendor), "Grapnel");
        std::snprintf(info_.name, sizeof(info_.name), "Fake sensor");
        present_ = true;
        address_ = address;
      }
      come = info_;
    }
    if (leaves) {
      deviceDisconnected(&left);
      sensor().announced = 0;
    }
    if (!comes) return;
    deviceConnected(&come);
    sensor().announced = address;
  }

  std::mutex mutex_;
  OniDeviceInfo info_{};
  bool present_ = false;
  std::int32_t address_ = 0;
  std::atomic<bool> stop_{false};
  std::thread bus_;
};

}  // namespace

ONI_EXPORT_DRIVER(FakeDriver)
