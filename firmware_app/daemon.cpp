#include "firmware_app/daemon.h"

#include <sys/random.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/clock.h"
#include "base/hash.h"
#include "base/input_error.h"
#include "drivers/modbus/modbus_server.h"
#include "drivers/modbus/sockets.h"
#include "drivers/registry.h"
#include "firmware_app/camera_keeper.h"
#include "firmware_app/config_keeper.h"
#include "firmware_app/config_loop.h"
#include "firmware_app/controller.h"
#include "firmware_app/crash_record.h"
#include "firmware_app/heartbeat.h"
#include "firmware_app/memory_plan.h"
#include "firmware_app/notify.h"
#include "firmware_app/recording_keeper.h"
#include "firmware_app/registration_loop.h"
#include "firmware_app/sensor_health.h"
#include "firmware_app/snapshot_keeper.h"

namespace grapnel {
namespace {

constexpr std::int64_t kTickUs = 50'000;

std::uint16_t random_boot_id() {
  std::uint16_t id = 0;
  while (id == 0) {
    if (getrandom(&id, sizeof id, 0) != sizeof id) return 1;
  }
  return id;
}

std::uint32_t build_hash() {
  constexpr std::string_view kBuild = GRAPNEL_BUILD_ID;
  return static_cast<std::uint32_t>(
      hash_bytes(std::as_bytes(std::span(kBuild.data(), kBuild.size()))));
}

/// All parts of the running appliance, in the order in which they are made; the main thread is
/// housekeeping.
class Daemon {
 public:
  explicit Daemon(const DaemonOptions& options) : options_(options) {}

  int run();

 private:
  void prepare_state();
  void load();
  void build();
  void start_threads();
  void stop_threads() noexcept;
  void serve();
  void tick(std::int64_t now_us);
  void drain_log();
  void save_background();
  void on_field_bus_thread() noexcept;
  [[nodiscard]] bool lock_memory_as_asked();
  void build_snapshots();
  void build_recorder();

  DaemonOptions options_;
  MonotonicClock clock_;
  Journal journal_;
  LogRing log_{clock_};
  ServiceNotifier notifier_;
  Exchange exchange_;
  PresetSwitch presets_;
  Supervisor supervisor_;
  CrashReporter crash_;
  ThreadAccount capture_account_;
  ThreadAccount registration_account_;
  ThreadAccount field_bus_account_;
  FilePresetSource source_;
  ControllerSetup setup_;

  Settings settings_;  // as at start
  std::filesystem::path state_folder_;
  std::unique_ptr<MemoryBlock> preset_memory_;
  std::unique_ptr<MemoryBlock> background_memory_;
  Background background_;
  std::unique_ptr<ConfigKeeper> keeper_;
  std::unique_ptr<ConfigLoop> config_;
  std::unique_ptr<FramePool> pool_;
  std::unique_ptr<CameraKeeper> camera_;
  std::unique_ptr<SensorHealth> sensor_health_;
  std::unique_ptr<MemoryBlock> evidence_memory_;
  EvidenceSlot evidence_;
  std::unique_ptr<SnapshotKeeper> snapshots_;
  std::unique_ptr<RecordingKeeper> recorder_;
  std::unique_ptr<JobExecutor> executor_;
  std::unique_ptr<RegistrationLoop> registration_;
  std::unique_ptr<Heartbeat> heartbeat_;
  std::unique_ptr<Controller> controller_;
  std::unique_ptr<ModbusServer> server_;
  Thread field_bus_thread_;
  std::atomic<bool> stop_{false};
};

void Daemon::prepare_state() {
  state_folder_ = settings_.state_folder();
  std::error_code error;
  std::filesystem::create_directories(state_folder_, error);
  if (error) {
    throw InputError("state.folder: " + state_folder_.string() + ": " + error.message());
  }
  setup_.boot_id = random_boot_id();
  setup_.build_hash = build_hash();
  setup_.auto_arm = settings_.general.auto_arm;
  const std::optional<CrashRecord> left = crash_.open(state_folder_ / "crash.bin", build_hash());
  if (left) {
    journal_.write(LogLevel::Fault, crash_text(*left));
    const bool watchdog = left->kind == CrashKind::Watchdog || left->signal == SIGABRT;
    setup_.watchdog_restart = watchdog && left->kind != CrashKind::Assertion;
    if (!setup_.watchdog_restart) setup_.fault = Code::InternalFault;
  }
  crash_.install();
}

/// Reads grapnel.toml, or what was last good.
void Daemon::load() {
  const ConfigKeeper::Reporter report = [this](bool refused, Code code, const std::string& line) {
    std::string text = refused ? "configuration refused: " + line : line;
    if (refused) text += " (" + std::to_string(static_cast<unsigned>(code)) + ")";
    journal_.write(refused ? LogLevel::Warning : LogLevel::Info, text);
  };
  const ConfigKeeper::Start start{options_.config, options_.overrides};
  settings_ = ConfigKeeper::settings_at_start(start);
  prepare_state();
  tune_heap();
  preset_memory_ = std::make_unique<MemoryBlock>(2 * settings_.preset_budget_bytes());
  ConfigKeeper::Parts parts{&exchange_, &source_, &presets_, report};
  keeper_ = std::make_unique<ConfigKeeper>(std::move(parts), start, preset_memory_->span());
  keeper_->start(state_folder_);
  config_ = std::make_unique<ConfigLoop>(
      ConfigLoop::Parts{keeper_.get(), &exchange_.config_wake, &clock_, &journal_},
      options_.config);
}

void Daemon::build_snapshots() {
  const CaptureSettings& capture = settings_.capture;
  evidence_memory_ = std::make_unique<MemoryBlock>(evidence_bytes(settings_));
  Arena arena(evidence_memory_->span());
  evidence_.reserve(arena, capture.max_width, capture.max_height, capture.color);
  snapshots_ = std::make_unique<SnapshotKeeper>(
      SnapshotKeeper::Parts{
          &evidence_, [this](std::uint32_t number) { return source_.origin(number); },
          [this](const std::string& line) { journal_.write(LogLevel::Warning, line); }},
      SnapshotKeeper::Facts{state_folder_ / "snapshots", settings_.snapshots.keep, GRAPNEL_BUILD_ID,
                            Registrar::simd_target()});
}

void Daemon::build_recorder() {
  recorder_ = std::make_unique<RecordingKeeper>(
      RecordingKeeper::Parts{
          &exchange_.record, pool_.get(), &clock_, [this] { return camera_->serial(); },
          [this](LogLevel level, const std::string& line) { journal_.write(level, line); }},
      settings_.recording, state_folder_ / "recordings");
}

void Daemon::build() {
  build_snapshots();
  const CaptureSettings& capture = settings_.capture;
  background_memory_ = std::make_unique<MemoryBlock>(background_bytes(settings_));
  Arena arena(background_memory_->span());
  background_.reserve(arena, capture.max_width, capture.max_height, settings_.belt.learn_frames);
  const std::vector<double>& plane = settings_.belt.plane;
  if (!plane.empty()) background_.set_plane({plane[0], plane[1], plane[2]}, plane[3]);
  try {
    if (background_.load(state_folder_ / "background.bin")) {
      journal_.write(LogLevel::Info, "the taught belt is loaded");
    }
  } catch (const InputError& problem) {
    journal_.write(LogLevel::Warning, problem.what());
  }
  pool_ = std::make_unique<FramePool>(static_cast<std::size_t>(capture.pool_frames),
                                      capture.max_width, capture.max_height, capture.color);
  const RealtimeSettings& realtime = settings_.realtime;
  sensor_health_ = std::make_unique<SensorHealth>(capture);
  sensor_health_->watch_belt(background_.reference());
  camera_ = std::make_unique<CameraKeeper>(
      make_camera(settings_.camera, clock_),
      CameraKeeper::Parts{pool_.get(), &supervisor_, &capture_account_, &journal_,
                          &exchange_.job.foreign_sensor},
      Scheduling{realtime.capture_priority, realtime.capture_cpu}, settings_.calibration.serial);
  build_recorder();
  executor_ = std::make_unique<JobExecutor>(
      ExecutorParts{&clock_, pool_.get(), &camera_->camera(), &background_, &exchange_.job,
                    &supervisor_.progress(Supervised::Registration), &crash_.job_stage(),
                    settings_.snapshots.keep > 0 ? &evidence_ : nullptr,
                    settings_.snapshots.on_reject},
      capture, settings_.belt.learn_frames);
  registration_ = std::make_unique<RegistrationLoop>(
      RegistrationLoop::Parts{executor_.get(), &exchange_.job, &presets_, &supervisor_,
                              &registration_account_, &crash_},
      Scheduling{realtime.registration_priority, realtime.registration_cpu});
  setup_.frames = pool_.get();
  controller_ = std::make_unique<Controller>(clock_, log_, exchange_, setup_);

  ModbusOptions modbus;
  modbus.identity.revision = version_text();
  modbus.log = &log_;
  modbus.inherited_listener = inherited_listener();
  modbus.hooks.context = this;
  modbus.hooks.thread_started = [](void* self) noexcept {
    static_cast<Daemon*>(self)->on_field_bus_thread();
  };
  modbus.hooks.progress = [](void* context) noexcept {
    auto* self = static_cast<Daemon*>(context);
    self->supervisor_.progress(Supervised::FieldBus).fetch_add(1, std::memory_order_relaxed);
    self->field_bus_account_.sample();
  };
  server_ = std::make_unique<ModbusServer>(settings_.fieldbus, *controller_, clock_, modbus);
  if (!server_->open()) throw InputError(server_->problem());
}

void Daemon::on_field_bus_thread() noexcept {
  name_this_thread("fieldbus");
  touch_stack();
  field_bus_account_.attach();
}

bool Daemon::lock_memory_as_asked() {
  if (!settings_.realtime.lock_memory) return true;
  std::string why;
  const bool locked = lock_memory(why);
  if (!locked) journal_.write(LogLevel::Warning, why);
  return locked;
}

void Daemon::start_threads() {
  bool started =
      snapshots_->start() && recorder_->start() && registration_->start() && camera_->start();
  started = started && field_bus_thread_.start(
                           [](void* context) {
                             auto* self = static_cast<Daemon*>(context);
                             self->server_->run(self->stop_);
                           },
                           this);
  started = started && config_->start();
  if (!started) throw InputError("threads can't be started");
  supervisor_.expect(Supervised::FieldBus, true);
}

void Daemon::stop_threads() noexcept {
  stop_.store(true, std::memory_order_release);
  if (server_) server_->wake();
  field_bus_thread_.join();
  if (config_) config_->stop();
  if (registration_) registration_->stop();
  if (recorder_) recorder_->stop();
  if (camera_) camera_->stop();
  if (snapshots_) snapshots_->stop();
}

void Daemon::drain_log() {
  LogEvent event;
  while (log_.pop(event)) {
    crash_.history().add(event);
    journal_.write(event);
    if (snapshots_) snapshots_->note(event_text(event));
  }
}

void Daemon::save_background() {
  try {
    if (background_.save_if_learned(state_folder_ / "background.bin")) {
      sensor_health_->take_reference();
      sensor_health_->watch_belt(background_.reference());
    }
  } catch (const InputError& problem) {
    journal_.write(LogLevel::Warning, problem.what());
  }
}

void Daemon::tick(std::int64_t now_us) {
  drain_log();
  save_background();
  if (!heartbeat_->beat(now_us)) return;
  notifier_.send("READY=1");
  journal_.write(LogLevel::Info, "ready, Modbus port " + std::to_string(server_->port()) +
                                     ", SIMD target " + Registrar::simd_target());
}

void Daemon::serve() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, signal);
  for (;;) {
    tick(clock_.now_us());
    const timespec wait{0, kTickUs * 1000};
    const int signal = sigtimedwait(&signals, nullptr, &wait);
    if (signal == SIGTERM || signal == SIGINT) break;
    if (signal == SIGHUP) config_->ask_reload();
  }
  notifier_.send("STOPPING=1");
}

int Daemon::run() {
  // Before any thread exists, so that all inherit the mask and housekeeping alone receives.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  name_this_thread("housekeeping");
  load();
  build();
  heartbeat_ = std::make_unique<Heartbeat>(
      Heartbeat::Parts{&exchange_,
                       &journal_,
                       &notifier_,
                       &supervisor_,
                       &crash_,
                       pool_.get(),
                       camera_.get(),
                       sensor_health_.get(),
                       registration_.get(),
                       {&capture_account_, &registration_account_, &field_bus_account_}},
      !lock_memory_as_asked(), clock_.now_us());
  try {
    start_threads();
    serve();
  } catch (...) {
    stop_threads();
    throw;
  }
  stop_threads();
  drain_log();
  save_background();
  journal_.write(LogLevel::Info, "stopped");
  return 0;
}

}  // namespace

const char* version_text() noexcept { return GRAPNEL_VERSION; }

int run_daemon(const DaemonOptions& options) { return Daemon(options).run(); }

}  // namespace grapnel
