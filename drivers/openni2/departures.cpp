#include "drivers/openni2/departures.h"

#include <OpenNI.h>

#include <map>
#include <mutex>

namespace grapnel {
namespace {

/// Called on threads of OpenNI's drivers; makes no call back into OpenNI.
class Departures final : public openni::OpenNI::DeviceDisconnectedListener {
 public:
  void onDeviceDisconnected(const openni::DeviceInfo* device) override {
    const std::lock_guard lock(mutex_);
    ++gone_[device->getUri()];
  }
  unsigned of(const std::string& uri) {
    const std::lock_guard lock(mutex_);
    const auto place = gone_.find(uri);
    return place == gone_.end() ? 0U : place->second;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, unsigned> gone_;
};

Departures& departures() {
  // Never destroyed: OpenNI's threads may call to the end.
  static auto* const listener = new Departures;
  return *listener;
}

}  // namespace

void watch_departures() {
  static const bool watching = [] {
    openni::OpenNI::addDeviceDisconnectedListener(&departures());
    return true;
  }();
  static_cast<void>(watching);
}

unsigned departures_of(const std::string& uri) { return departures().of(uri); }

}  // namespace grapnel
