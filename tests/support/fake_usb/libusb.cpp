// A substitute libusb-1.0.so.0 with one Kinect v1 on its bus: as much of the library's interface as
// libfreenect calls.
#include <libusb.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/fake_usb/kinect_protocol.h"
#include "tests/support/fake_usb/kinect_stream.h"

using grapnel::test::FakeKinect;
using grapnel::test::KinectProtocol;
using grapnel::test::KinectStream;

struct libusb_context {};

struct libusb_device {
  libusb_context* context = nullptr;
  bool motor = false;
  std::int32_t address = 0;
  int references = 1;
};

struct libusb_device_handle {
  libusb_device* device = nullptr;
  KinectProtocol protocol;
  KinectStream depth{KinectStream::Kind::Depth};
  KinectStream color{KinectStream::Kind::Color};
  std::deque<libusb_transfer*> cancelled;
};

namespace {

constexpr std::uint16_t kMicrosoft = 0x045e;
constexpr std::uint16_t kCamera = 0x02ae;
constexpr std::uint16_t kMotor = 0x02b0;
constexpr std::uint16_t kModel1414 = 267;
constexpr unsigned char kDepthEndpoint = 0x82;
constexpr auto kNap = std::chrono::milliseconds(1);

std::recursive_mutex bus;
// Never destroyed: a call that never returns outlives main().
auto& open_handles = *new std::vector<libusb_device_handle*>;
libusb_device_handle* claimed_camera = nullptr;

FakeKinect* mapped_kinect() {
  static FakeKinect own;
  const char* const file = std::getenv("GRAPNEL_FAKE_KINECT");
  if (file == nullptr) return &own;
  const int descriptor = ::open(file, O_RDWR | O_CLOEXEC);
  if (descriptor < 0) std::abort();
  void* const memory =
      ::mmap(nullptr, sizeof(FakeKinect), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  ::close(descriptor);
  if (memory == MAP_FAILED) std::abort();
  return static_cast<FakeKinect*>(memory);
}

std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// When the unit was plugged in.
std::int64_t epoch_us() {
  static const std::int64_t epoch = now_us();
  return epoch;
}

bool present(const libusb_device& device) {
  const FakeKinect& kinect = *grapnel_fake_kinect();
  if (kinect.plugged.load() == 0 || device.address != kinect.address.load()) return false;
  return !device.motor || kinect.motor.load() != 0;
}

void unreference(libusb_device* device) {
  if (--device->references == 0) delete device;
}

/// One callback that is due, nullptr when there is none.
libusb_transfer* next_finished(const libusb_context* context) {
  for (libusb_device_handle* const handle : open_handles) {
    if (handle->device->context != context) continue;
    if (!handle->cancelled.empty()) {
      libusb_transfer* const transfer = handle->cancelled.front();
      handle->cancelled.pop_front();
      transfer->status = LIBUSB_TRANSFER_CANCELLED;
      return transfer;
    }
    // In the order in which a bus completes them, also for a host that lags.
    const bool color_first = handle->color.next_us() < handle->depth.next_us();
    KinectStream* const first = color_first ? &handle->color : &handle->depth;
    KinectStream* const second = color_first ? &handle->depth : &handle->color;
    for (KinectStream* const stream : {first, second}) {
      if (!present(*handle->device)) {
        libusb_transfer* const transfer = stream->take_any();
        if (transfer == nullptr) continue;
        transfer->status = LIBUSB_TRANSFER_NO_DEVICE;
        return transfer;
      }
      if (libusb_transfer* const transfer = stream->finish(now_us()); transfer != nullptr) {
        return transfer;
      }
    }
  }
  return nullptr;
}

int handle_events(const libusb_context* context, std::int64_t until_us) {
  const FakeKinect& kinect = *grapnel_fake_kinect();
  for (;;) {
    while (kinect.hang_events.load() != 0) std::this_thread::sleep_for(kNap);
    bool delivered = false;
    for (int i = 0; i < 64; ++i) {
      libusb_transfer* finished = nullptr;
      {
        const std::lock_guard lock(bus);
        finished = next_finished(context);
      }
      if (finished == nullptr) break;
      finished->callback(finished);
      delivered = true;
    }
    if (delivered || now_us() >= until_us) return 0;
    std::this_thread::sleep_for(kNap);
  }
}

}  // namespace

extern "C" {

FakeKinect* grapnel_fake_kinect() {
  static FakeKinect* const kinect = mapped_kinect();
  return kinect;
}

int libusb_init(libusb_context** context) {
  *context = new libusb_context;
  static_cast<void>(epoch_us());
  return 0;
}

void libusb_exit(libusb_context* context) { delete context; }

ssize_t libusb_get_device_list(libusb_context* context, libusb_device*** list) {
  const FakeKinect& kinect = *grapnel_fake_kinect();
  *list = new libusb_device* [3] {};
  ssize_t count = 0;
  if (kinect.plugged.load() == 0) return 0;
  (*list)[count++] = new libusb_device{context, false, kinect.address.load()};
  if (kinect.motor.load() != 0)
    (*list)[count++] = new libusb_device{context, true, kinect.address.load()};
  return count;
}

void libusb_free_device_list(libusb_device** list, int unref) {
  const std::lock_guard lock(bus);
  for (libusb_device** device = list; unref != 0 && *device != nullptr; ++device) {
    unreference(*device);
  }
  delete[] list;
}

int libusb_get_device_descriptor(libusb_device* device, libusb_device_descriptor* descriptor) {
  *descriptor = {};
  descriptor->idVendor = kMicrosoft;
  descriptor->idProduct = device->motor ? kMotor : kCamera;
  descriptor->bcdDevice = kModel1414;
  descriptor->iSerialNumber = 3;
  return 0;
}

uint8_t libusb_get_bus_number(libusb_device*) { return 1; }
libusb_device* libusb_get_parent(libusb_device*) { return nullptr; }

int libusb_open(libusb_device* device, libusb_device_handle** handle) {
  FakeKinect& kinect = *grapnel_fake_kinect();
  while (kinect.hang_open.load() != 0) std::this_thread::sleep_for(kNap);
  const std::lock_guard lock(bus);
  if (!present(*device)) return LIBUSB_ERROR_NO_DEVICE;
  if (kinect.denied.load() != 0) return LIBUSB_ERROR_ACCESS;
  ++device->references;
  *handle = new libusb_device_handle;
  (*handle)->device = device;
  open_handles.push_back(*handle);
  ++kinect.handles;
  return 0;
}

void libusb_close(libusb_device_handle* handle) {
  const std::lock_guard lock(bus);
  std::erase(open_handles, handle);
  if (claimed_camera == handle) claimed_camera = nullptr;
  unreference(handle->device);
  delete handle;
  --grapnel_fake_kinect()->handles;
}

libusb_device* libusb_get_device(libusb_device_handle* handle) { return handle->device; }

int libusb_get_string_descriptor_ascii(libusb_device_handle* handle, uint8_t, unsigned char* text,
                                       int bytes) {
  if (!present(*handle->device)) return LIBUSB_ERROR_NO_DEVICE;
  const std::string serial = grapnel_fake_kinect()->serial;
  const int length = std::min(bytes - 1, static_cast<int>(serial.size()));
  std::memcpy(text, serial.data(), static_cast<std::size_t>(length));
  text[length] = '\0';
  return length;
}

int libusb_kernel_driver_active(libusb_device_handle*, int) { return 0; }
int libusb_attach_kernel_driver(libusb_device_handle*, int) { return 0; }
int libusb_detach_kernel_driver(libusb_device_handle*, int) { return 0; }

int libusb_claim_interface(libusb_device_handle* handle, int) {
  const std::lock_guard lock(bus);
  if (!present(*handle->device)) return LIBUSB_ERROR_NO_DEVICE;
  if (handle->device->motor) return 0;
  const bool taken =
      claimed_camera != nullptr && claimed_camera != handle && present(*claimed_camera->device);
  if (taken) return LIBUSB_ERROR_BUSY;
  claimed_camera = handle;
  return 0;
}

int libusb_release_interface(libusb_device_handle* handle, int) {
  const std::lock_guard lock(bus);
  if (claimed_camera == handle) claimed_camera = nullptr;
  return 0;
}

int libusb_set_interface_alt_setting(libusb_device_handle*, int, int) { return 0; }
int libusb_reset_device(libusb_device_handle*) { return 0; }
const char* libusb_error_name(int) { return "error of the substitute libusb"; }

int libusb_get_max_iso_packet_size(libusb_device*, unsigned char endpoint) {
  return endpoint == kDepthEndpoint ? 1760 : 1920;
}

int libusb_get_active_config_descriptor(libusb_device*, libusb_config_descriptor**) {
  return LIBUSB_ERROR_NOT_SUPPORTED;
}
void libusb_free_config_descriptor(libusb_config_descriptor*) {}
int libusb_bulk_transfer(libusb_device_handle*, unsigned char, unsigned char*, int, int*,
                         unsigned int) {
  return LIBUSB_ERROR_NOT_SUPPORTED;
}

int libusb_control_transfer(libusb_device_handle* handle, uint8_t type, uint8_t request, uint16_t,
                            uint16_t, unsigned char* data, uint16_t bytes, unsigned int) {
  FakeKinect& kinect = *grapnel_fake_kinect();
  while (kinect.hang_control.load() != 0) std::this_thread::sleep_for(kNap);
  const std::lock_guard lock(bus);
  ++kinect.controls;
  if (!present(*handle->device)) return LIBUSB_ERROR_NO_DEVICE;
  if (handle->device->motor) return KinectProtocol::read_motor(request, data, bytes);
  if ((type & LIBUSB_ENDPOINT_IN) != 0) return handle->protocol.read_reply(data, bytes);
  const KinectProtocol::Switch change = handle->protocol.write_command(data, bytes);
  for (KinectStream* const stream : {&handle->depth, &handle->color}) {
    const bool depth = stream->kind() == KinectStream::Kind::Depth;
    const auto wanted = depth ? change.depth : change.color;
    if (wanted == KinectProtocol::Turn::On) stream->switch_on(epoch_us(), now_us());
    if (wanted == KinectProtocol::Turn::Off) stream->switch_off();
  }
  return bytes;
}

libusb_transfer* libusb_alloc_transfer(int packets) {
  const std::size_t bytes = sizeof(libusb_transfer) + static_cast<std::size_t>(packets) *
                                                          sizeof(libusb_iso_packet_descriptor);
  ++grapnel_fake_kinect()->transfers;
  return static_cast<libusb_transfer*>(std::calloc(1, bytes));
}

void libusb_free_transfer(libusb_transfer* transfer) {
  if (transfer != nullptr) --grapnel_fake_kinect()->transfers;
  std::free(transfer);
}

int libusb_submit_transfer(libusb_transfer* transfer) {
  const std::lock_guard lock(bus);
  libusb_device_handle* const handle = transfer->dev_handle;
  if (!present(*handle->device)) return LIBUSB_ERROR_NO_DEVICE;
  (transfer->endpoint == kDepthEndpoint ? handle->depth : handle->color).submit(transfer);
  return 0;
}

int libusb_cancel_transfer(libusb_transfer* transfer) {
  const std::lock_guard lock(bus);
  libusb_device_handle* const handle = transfer->dev_handle;
  if (!handle->depth.withdraw(transfer) && !handle->color.withdraw(transfer)) {
    return LIBUSB_ERROR_NOT_FOUND;
  }
  handle->cancelled.push_back(transfer);
  return 0;
}

int libusb_handle_events_timeout(libusb_context* context, timeval* limit) {
  return handle_events(context, now_us() + limit->tv_sec * 1'000'000 + limit->tv_usec);
}

int libusb_handle_events(libusb_context* context) {
  return handle_events(context, now_us() + 60'000'000);
}

}  // extern "C"
