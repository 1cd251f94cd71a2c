#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace grapnel {

/// The encoder counts that the PLC streamed lately, to read the belt's place at a frame's
/// mid-exposure. Counts are 32 bits wide and wrap. One thread; allocates nothing.
class EncoderTrack {
 public:
  /// Counts further apart than this are no stream: two periods of 50 Hz, and what the network adds.
  static constexpr std::int64_t kLongestGapUs = 50'000;
  /// Counts closer than this to the last one kept are not kept.
  static constexpr std::int64_t kShortestGapUs = 10'000;

  void add(std::uint32_t count, std::int64_t now_us) noexcept;

  /// Count at a moment that two streamed ones enclose, in proportion; none otherwise.
  [[nodiscard]] std::optional<std::uint32_t> at(std::int64_t time_us) const noexcept;

 private:
  struct Sample {
    std::int64_t time_us = 0;
    std::uint32_t count = 0;
  };
  // Some seconds of a stream: longer than any job.
  std::array<Sample, 512> ring_{};
  std::size_t next_ = 0;
  std::size_t held_ = 0;
};

}  // namespace grapnel
