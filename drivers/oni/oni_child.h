#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/input_error.h"
#include "drivers/oni/oni_wire.h"

namespace grapnel {

/// The player ended, or stands still, without having said why.
class OniPlayerLost : public InputError {
 public:
  using InputError::InputError;
};

/// grapnel-oni-player on one file: OpenNI's player crashes and hangs at random, in a process of its
/// own. It is killed with this object, and dies with this program.
class OniChild {
 public:
  /// Starts the player and waits for its head. Throws OniPlayerLost, or InputError with what the
  /// player says of the file.
  OniChild(const std::filesystem::path& player, const std::filesystem::path& file,
           std::int64_t limit_us);
  OniChild(const OniChild&) = delete;
  OniChild& operator=(const OniChild&) = delete;
  ~OniChild();

  [[nodiscard]] const OniHead& head() const noexcept { return head_; }
  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  /// The next record with its bytes; nothing when it is not complete within the time, the rest is
  /// then waited for by the next call. Throws as the constructor.
  [[nodiscard]] std::optional<OniRecord> next(std::int64_t limit_us, std::vector<std::byte>& bytes);

 private:
  /// Reads until `want` bytes are in `into`. False: time is over.
  [[nodiscard]] bool fill(std::vector<std::byte>& into, std::size_t want, std::int64_t until_us);
  void check(const OniRecord& record) const;
  [[noreturn]] void lost(const char* how) const;
  void end() noexcept;

  std::filesystem::path file_;
  OniHead head_;
  pid_t pid_ = -1;
  int pipe_ = -1;
  std::vector<std::byte> partial_;  // of a record's head
  std::optional<OniRecord> record_;
  std::vector<std::byte> body_;
};

}  // namespace grapnel
