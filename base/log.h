#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "base/clock.h"
#include "base/error.h"

namespace grapnel {

enum class LogLevel : std::uint8_t { Debug, Info, Warning, Fault };

/// What a real-time thread says: a fixed text and up to three numbers, no formatting.
struct LogEvent {
  std::int64_t time_us = 0;
  const char* text = "";  ///< static storage; {} stands for the next number
  std::array<std::int64_t, 3> numbers{};
  Code code = Code::Ok;
  Stage stage = Stage::None;
  LogLevel level = LogLevel::Info;
};

/// Bounded queue of events from any thread to the housekeeping thread (Vyukov's bounded queue).
/// Pushing never blocks, allocates or formats; when full the event is counted as lost.
class LogRing {
 public:
  static constexpr std::size_t kCapacity = 1024;

  explicit LogRing(const Clock& clock) noexcept;

  void push(LogLevel level, Stage stage, Code code, const char* text, std::int64_t a = 0,
            std::int64_t b = 0, std::int64_t c = 0) noexcept;
  /// Takes the oldest event. One reader only.
  [[nodiscard]] bool pop(LogEvent& event) noexcept;
  /// Events lost because the ring was full, since start.
  [[nodiscard]] std::uint64_t lost() const noexcept {
    return lost_.load(std::memory_order_relaxed);
  }

 private:
  struct Cell {
    std::atomic<std::size_t> turn{0};
    LogEvent event;
  };
  const Clock* clock_;
  std::array<Cell, kCapacity> cells_;
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::size_t tail_ = 0;
  alignas(64) std::atomic<std::uint64_t> lost_{0};
};

}  // namespace grapnel
