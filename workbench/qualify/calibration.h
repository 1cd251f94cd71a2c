#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

/// A check whose limit can be set from labelled poses, and the preset's key for it.
struct LimitedCheck {
  std::string_view check;  ///< as in results.jsonl under "checks"
  std::string_view key;    ///< of the preset's table [accept]
  bool at_least = true;
};
inline constexpr std::array<LimitedCheck, 14> kLimitedChecks = {{
    {"matched_share", "min_fitness", true},
    {"seen_through", "max_seen_through", false},
    {"unknown", "max_unknown", false},
    {"outside", "max_outside", false},
    {"unexplained", "max_unexplained", false},
    {"explained", "min_explained", true},
    {"outline_known", "min_edge_known", true},
    {"outline", "min_edge", true},
    {"flat_proof", "min_flat_proof", true},
    {"margin", "min_margin", true},
    {"mirror_margin", "min_mirror_margin", true},
    {"sigma_m", "max_sigma_m", false},
    {"sigma_rad", "max_sigma_rad", false},
    {"belt_distance_m", "max_belt_distance_m", false},
}};

/// What the checks measured of one pose that is known to be right or wrong.
struct LabelledPose {
  std::string id;
  bool right = false;
  std::array<double, kLimitedChecks.size()> measured;  ///< NaN = not looked at

  LabelledPose() { measured.fill(std::numeric_limits<double>::quiet_NaN()); }
};

/// One check after calibration.
struct CheckLimit {
  bool set = false;  ///< there were right poses to set it by
  double limit = 0.0;
  double worst_right = 0.0;  ///< nearest to the limit of all right poses
  double median_right = 0.0;
  std::size_t rejects = 0;  ///< wrong poses beyond the limit
  std::size_t alone = 0;    ///< of these, those that no other check rejects
};

struct Calibration {
  std::array<CheckLimit, kLimitedChecks.size()> limits;
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::vector<std::string> inseparable;  ///< wrong poses as good as a right one in every check
};

/// Sets each limit beyond the worst right pose by the distance from median to worst (for a share at
/// least 0.02, else a tenth of the worst), then draws in, half way to the worst right pose, the
/// check that separates each wrong pose still passing the most. O(poses²).
[[nodiscard]] Calibration calibrate(std::span<const LabelledPose> poses);

/// The table [accept] of a preset, and as comments what each limit rests on.
[[nodiscard]] std::string accept_table(const Calibration& calibration);

}  // namespace grapnel
