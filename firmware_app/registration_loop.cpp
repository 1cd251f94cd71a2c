#include "firmware_app/registration_loop.h"

namespace grapnel {
namespace {

constexpr std::int64_t kIdleUs = 50'000;

}  // namespace

bool RegistrationLoop::start() {
  parts_.supervisor->expect(Supervised::Registration, true);
  return thread_.start([](void* self) { static_cast<RegistrationLoop*>(self)->run(); }, this);
}

void RegistrationLoop::stop() noexcept {
  parts_.supervisor->expect(Supervised::Registration, false);
  stop_.store(true, std::memory_order_release);
  for (std::atomic<bool>& cancel : parts_.exchange->cancel) cancel.store(true);
  parts_.exchange->wake.notify();
  thread_.join();
}

bool RegistrationLoop::round() noexcept {
  JobExchange& exchange = *parts_.exchange;
  if (ActivePreset* preset = parts_.presets->take()) {
    parts_.executor->use(preset);
    parts_.presets->confirm(preset);
  }
  if (!exchange.request.update()) return false;
  const JobRequest& request = exchange.request.get();
  if (!exchange.cancel_of(request.number).load(std::memory_order_acquire)) {
    parts_.crash->set_command_token(request.command.seq);
    parts_.executor->execute(request, exchange.outcome.writable());
    exchange.outcome.publish();
    parts_.executor->hand_over(request);
    parts_.crash->set_command_token(0);
  }
  exchange.finished.store(request.number, std::memory_order_release);
  return true;
}

void RegistrationLoop::run() {
  name_this_thread("registration");
  touch_stack();
  if (!schedule_this_thread(scheduling_)) scheduling_refused_.store(true);
  parts_.account->attach();
  while (!stop_.load(std::memory_order_acquire)) {
    const std::uint32_t seen = parts_.exchange->wake.version();
    const bool worked = round();
    parts_.account->sample();
    parts_.supervisor->progress(Supervised::Registration).fetch_add(1, std::memory_order_relaxed);
    if (!worked) parts_.exchange->wake.wait(seen, kIdleUs);
  }
}

}  // namespace grapnel
