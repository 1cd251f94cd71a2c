#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/oni/oni_child.h"

namespace grapnel {

/// Name of the player's program, beside the camera plug-ins.
inline constexpr const char* kOniPlayer = "grapnel-oni-player";

/// An .oni file from its begin to its end, every frame once, whatever becomes of the player: one
/// that crashes or stands still is replaced and the frames already seen are passed over.
class OniReader {
 public:
  /// A player that delivers nothing for this long is replaced.
  static constexpr std::int64_t kSilence_us = 5'000'000;
  /// Players in a row that may be lost without a new frame.
  static constexpr int kMaxLosses = 5;

  /// Throws InputError when the file can't be played.
  OniReader(std::filesystem::path player, std::filesystem::path file);

  [[nodiscard]] const OniHead& head() const noexcept { return child_->head(); }
  /// The next frame with its bytes, or the end; nothing within the time. Throws InputError when no
  /// player gets any further.
  [[nodiscard]] std::optional<OniRecord> next(std::int64_t limit_us, std::vector<std::byte>& bytes);
  /// Players that were replaced so far.
  [[nodiscard]] int losses() const noexcept { return losses_; }
  [[nodiscard]] pid_t player() const noexcept { return child_->pid(); }

 private:
  /// Starts a player, another one where it is lost before it plays.
  void begin();
  /// Within a handler of OniPlayerLost: rethrows when there is no hope.
  void count_loss();
  [[nodiscard]] bool seen_before(const OniRecord& record) noexcept;

  std::filesystem::path player_;
  std::filesystem::path file_;
  std::unique_ptr<OniChild> child_;
  std::int64_t depth_seen_ = 0;
  std::int64_t color_seen_ = 0;
  std::int64_t depth_here_ = 0;  // of this player
  std::int64_t color_here_ = 0;
  std::int64_t heard_us_ = 0;
  int losses_ = 0;
  int in_a_row_ = 0;
};

}  // namespace grapnel
