#include "drivers/oni/oni_reader.h"

#include <utility>

#include "base/clock.h"

namespace grapnel {

OniReader::OniReader(std::filesystem::path player, std::filesystem::path file)
    : player_(std::move(player)), file_(std::move(file)) {
  begin();
}

void OniReader::begin() {
  child_.reset();
  while (child_ == nullptr) {
    try {
      child_ = std::make_unique<OniChild>(player_, file_, kSilence_us);
    } catch (const OniPlayerLost&) {
      count_loss();
    }
  }
  depth_here_ = 0;
  color_here_ = 0;
  heard_us_ = MonotonicClock().now_us();
}

void OniReader::count_loss() {
  if (++in_a_row_ >= kMaxLosses) throw;
  ++losses_;
}

bool OniReader::seen_before(const OniRecord& record) noexcept {
  if (record.kind == OniKind::End) return false;
  const bool depth = record.kind == OniKind::Depth;
  std::int64_t& here = depth ? depth_here_ : color_here_;
  std::int64_t& seen = depth ? depth_seen_ : color_seen_;
  if (++here <= seen) return true;
  seen = here;
  in_a_row_ = 0;
  return false;
}

std::optional<OniRecord> OniReader::next(std::int64_t limit_us, std::vector<std::byte>& bytes) {
  const MonotonicClock clock;
  const std::int64_t until_us = clock.now_us() + limit_us;
  if (child_ == nullptr) begin();
  for (;;) {
    try {
      const std::int64_t left_us = until_us - clock.now_us();
      const std::optional<OniRecord> record = child_->next(left_us > 0 ? left_us : 0, bytes);
      const std::int64_t now_us = clock.now_us();
      if (record) heard_us_ = now_us;
      if (record && !seen_before(*record)) return record;
      if (!record && now_us - heard_us_ > kSilence_us) {
        throw OniPlayerLost(file_.string() + ": the player stands still");
      }
      if (now_us >= until_us) return std::nullopt;  // also amid frames already seen
    } catch (const OniPlayerLost&) {
      count_loss();
      begin();
    }
  }
}

}  // namespace grapnel
