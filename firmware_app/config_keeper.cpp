#include "firmware_app/config_keeper.h"

#include <exception>
#include <utility>

#include "firmware_app/durable_file.h"

namespace grapnel {
namespace {

std::string read_text(const std::filesystem::path& file) {
  try {
    return read_config_text(file);
  } catch (const InputError& problem) {
    std::error_code unreadable;
    const bool large = std::filesystem::file_size(file, unreadable) > kMaxConfigBytes;
    throw ConfigProblem(large && !unreadable ? Code::PresetInvalid : Code::FileUnreadable,
                        problem.what());
  }
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

Settings parse_settings(const std::string& text, const ConfigKeeper::Start& start) {
  try {
    ConfigTable root = parse_config(text, start.file.string());
    for (const std::string& assignment : start.overrides) apply_override(root, assignment);
    Settings settings =
        read_settings(root, start.file, std::filesystem::absolute(start.file).parent_path());
    settings.text = text;
    return settings;
  } catch (const InputError& problem) {
    throw ConfigProblem(Code::PresetInvalid, problem.what());
  }
}

constexpr const char* kLastGood = "last_good.toml";

/// "" when none is kept. Throws InputError when it is damaged.
std::string read_last_good(const std::filesystem::path& state_folder) {
  const auto bytes = read_durable(state_folder / kLastGood);
  if (!bytes) return {};
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

}  // namespace

ConfigKeeper::ConfigKeeper(Parts parts, Start start, std::span<std::byte> block)
    : parts_(std::move(parts)), start_(std::move(start)), block_(block) {}

std::span<std::byte> ConfigKeeper::free_half() const {
  const std::size_t half = block_.size() / 2;
  const bool second = current_ != nullptr && current_->half == 0;
  return block_.subspan(second ? half : 0, half);
}

std::unique_ptr<ActivePreset> ConfigKeeper::build(const Settings& settings, std::uint16_t number) {
  const std::span<std::byte> memory = free_half();
  std::unique_ptr<ActivePreset> preset = parts_.source->load(settings, number, memory);
  preset->half = memory.data() == block_.data() ? 0 : 1;
  return preset;
}

ConfigKeeper::Loaded ConfigKeeper::load_text(const std::string& text, std::uint16_t choice) {
  Loaded loaded;
  loaded.settings = parse_settings(text, start_);
  // A file that names another preset than before overrules the PLC; any other edit leaves its
  // choice.
  const int named = loaded.settings.general.active_preset;
  loaded.choice = named == settings_.general.active_preset ? choice : std::uint16_t{0};
  loaded.preset = build(loaded.settings,
                        loaded.choice != 0 ? loaded.choice : static_cast<std::uint16_t>(named));
  return loaded;
}

ConfigKeeper::Loaded ConfigKeeper::load_file() {
  return load_text(read_text(start_.file), choice_);
}

Settings ConfigKeeper::settings_at_start(const Start& start) {
  try {
    return parse_settings(read_text(start.file), start);
  } catch (const ConfigProblem&) {
    Settings defaults;
    defaults.base = std::filesystem::absolute(start.file).parent_path();
    std::string good;
    try {
      good = read_last_good(defaults.state_folder());
    } catch (const InputError&) {
      good.clear();  // start() reports it
    }
    if (good.empty()) throw;
    return parse_settings(good, start);
  }
}

void ConfigKeeper::start(const std::filesystem::path& state_folder) {
  good_file_ = state_folder / kLastGood;
  try {
    good_text_ = read_last_good(state_folder);
  } catch (const InputError& problem) {
    parts_.report(true, Code::FileUnreadable, problem.what());
  }
  Loaded loaded;
  try {
    loaded = load_file();
  } catch (const ConfigProblem& problem) {
    if (good_text_.empty()) throw;
    parts_.report(true, problem.code(), problem.what());
    loaded = load_text(good_text_, 0);
    state_.state = Code::RolledBack;
    state_.reduced = true;
    parts_.report(true, Code::RolledBack, "the last good configuration is in use");
  }
  settings_ = std::move(loaded.settings);
  committed_ = settings_.text == good_text_;
  current_ = std::move(loaded.preset);
  parts_.presets->offer(current_.get(), parts_.exchange->job.wake);
  state_.active = current_->profile.preset;
  state_.calibrated = current_->profile.calibrated;
  publish();
}

void ConfigKeeper::step(bool file_changed) {
  if (next_ != nullptr) {
    if (parts_.presets->in_use(next_.get())) finish_switch();
    if (next_ != nullptr) return;
  }
  commit_when_proven();
  if (parts_.exchange->config.request.update()) {
    work_off(parts_.exchange->config.request.get());
    return;
  }
  if (!file_changed) return;
  try {
    begin_switch(load_file(), Code::ConfigLoaded, false);
  } catch (const ConfigProblem& problem) {
    refuse(problem, true);
  } catch (const std::exception& problem) {
    refuse(ConfigProblem(Code::FileUnreadable, problem.what()), true);
  }
}

void ConfigKeeper::work_off(const ConfigRequest& request) {
  wish_ = request;
  owes_answer_ = true;
  const std::uint16_t number =
      request.preset != 0 ? request.preset : current_->profile.preset.number;
  try {
    switch (request.action) {
      case ConfigAction::Select: {
        Loaded loaded;
        loaded.settings = settings_;
        loaded.choice = number;
        loaded.preset = build(settings_, number);
        begin_switch(std::move(loaded), state_.reduced ? state_.state : Code::ConfigLoaded,
                     state_.reduced);
        return;
      }
      case ConfigAction::Check:
        parts_.source->check(settings_, number, block_.size() / 2);
        answer(Code::ConfigLoaded);
        return;
      case ConfigAction::Reload:
        begin_switch(load_file(), Code::ConfigLoaded, false);
        return;
      case ConfigAction::LastGood:
        if (good_text_.empty()) {
          throw ConfigProblem(Code::FileUnreadable, "no last good configuration is kept yet");
        }
        begin_switch(load_text(good_text_, 0), Code::RolledBack, true);
        return;
      case ConfigAction::None:
        answer(Code::ConfigLoaded);
        return;
    }
  } catch (const ConfigProblem& problem) {
    refuse(problem, request.action == ConfigAction::Reload);
  } catch (const std::exception& problem) {
    refuse(ConfigProblem(Code::FileUnreadable, problem.what()),
           request.action == ConfigAction::Reload);
  }
}

void ConfigKeeper::begin_switch(Loaded loaded, Code state, bool reduced) {
  const std::string later = needs_restart(settings_, loaded.settings);
  if (!later.empty()) {
    parts_.report(false, Code::ConfigLoaded, later + " changed: takes effect at the next start");
  }
  next_ = std::move(loaded.preset);
  incoming_ = std::move(loaded);
  incoming_state_ = state;
  incoming_reduced_ = reduced;
  parts_.presets->offer(next_.get(), parts_.exchange->job.wake);
}

void ConfigKeeper::finish_switch() {
  current_ = std::move(next_);
  settings_ = std::move(incoming_->settings);
  choice_ = incoming_->choice;
  incoming_.reset();
  committed_ = settings_.text == good_text_;
  jobs_at_load_ = parts_.exchange->job.finished.load(std::memory_order_acquire);
  state_.state = incoming_state_;
  state_.state_detail = 0;
  state_.reduced = incoming_reduced_;
  state_.active = current_->profile.preset;
  state_.calibrated = current_->profile.calibrated;
  ++state_.reloads;
  parts_.report(false, Code::ConfigLoaded,
                "preset " + std::to_string(state_.active.number) + " is in use");
  if (owes_answer_) {
    answer(Code::ConfigLoaded);
  } else {
    publish();
  }
}

void ConfigKeeper::refuse(const ConfigProblem& problem, bool from_file) {
  ++state_.refusals;
  if (from_file) {
    state_.state = problem.code();
    state_.reduced = true;
  }
  parts_.report(true, problem.code(), problem.what());
  if (owes_answer_) {
    answer(problem.code());
  } else {
    publish();
  }
}

void ConfigKeeper::answer(Code code, std::uint16_t detail) {
  owes_answer_ = false;
  state_.answered = wish_.number;
  state_.answer = code;
  state_.answer_detail = detail;
  publish();
}

void ConfigKeeper::commit_when_proven() {
  if (committed_ || state_.reduced) return;
  const std::uint32_t finished = parts_.exchange->job.finished.load(std::memory_order_acquire);
  if (finished - jobs_at_load_ < kProvisionalJobs) return;
  committed_ = true;
  good_text_ = settings_.text;
  try {
    write_durable(good_file_, bytes_of(good_text_));
  } catch (const InputError& problem) {
    parts_.report(true, Code::DiskFull, problem.what());
  }
}

void ConfigKeeper::publish() { parts_.exchange->config.state.publish(state_); }

}  // namespace grapnel
