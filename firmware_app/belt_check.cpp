#include "firmware_app/belt_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "base/fixed_list.h"
#include "base/rng.h"

namespace grapnel {
namespace {

constexpr int kColumns = 16;
constexpr int kRows = 12;
constexpr std::size_t kTiles = std::size_t{kColumns} * kRows;
constexpr int kSide = 10;  // samples of a tile, each way
constexpr std::size_t kSamples = std::size_t{kSide} * kSide;
constexpr std::size_t kMinSamples = 30;
constexpr double kBand_m = 0.06;
constexpr double kBelowShare = 0.5;
constexpr std::size_t kMinTiles = 12;
constexpr double kMostOfTiles = 0.5;
constexpr double kSomeOfTiles = 0.15;
// Reflections and edges make a tile look lower than it is now and then.
constexpr double kLowerTiles = 0.05;
constexpr int kTrials = 96;
// Of the heights within the band, a millimetre each.
constexpr int kBinsToASide = 60;
constexpr std::size_t kBins = 2 * kBinsToASide + 1;
constexpr double kBin_m = 1e-3;
// As plane_fit.cpp: a step of the sensor is 2.9 mm z², and belts are uneven by 2 mm.
constexpr double kStepPerSquareMetre = 2.9e-3;
constexpr double kUnevennessM = 2e-3;

/// A flat piece of the image: place on the taught plane, height above it.
struct Tile {
  double s = 0.0;
  double t = 0.0;
  double height_m = 0.0;
  double tolerance_m = 0.0;
};
using Tiles = InlineList<Tile, kTiles>;

/// height = slope_s s + slope_t t + level
struct Slope {
  Vec3d coefficients = Vec3d::Zero();
  [[nodiscard]] double at(const Tile& tile) const noexcept {
    return coefficients.dot(Vec3d(tile.s, tile.t, 1.0));
  }
  [[nodiscard]] bool holds(const Tile& tile) const noexcept {
    return std::abs(at(tile) - tile.height_m) <= tile.tolerance_m;
  }
};

class BeltView {
 public:
  BeltView(const DepthFrame& frame, const BeltPlane& taught) noexcept
      : frame_(frame), taught_(taught) {
    const Vec3d axis =
        std::abs(taught.normal.x()) < 0.9 ? Vec3d(1.0, 0.0, 0.0) : Vec3d(0.0, 1.0, 0.0);
    along_s_ = taught.normal.cross(axis).normalized();
    along_t_ = taught.normal.cross(along_s_);
  }

  void look() noexcept {
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) look_at(column, row);
    }
  }
  [[nodiscard]] const Tiles& tiles() const noexcept { return tiles_; }
  /// How the readings lie about the taught plane, for a belt at `shift_m` from it.
  void fill_shares(double shift_m, BeltDrift& drift) const noexcept {
    if (readings_ == 0) return;
    const double z_m = std::abs(taught_.offset_m);
    const double tolerance_m = kUnevennessM + 2.0 * kStepPerSquareMetre * z_m * z_m;
    std::size_t below = below_;
    std::size_t above = readings_ - below_;
    std::size_t in_place = 0;
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      const double height_m = (static_cast<double>(bin) - kBinsToASide) * kBin_m;
      if (height_m < -tolerance_m) below += heights_[bin];
      if (height_m <= shift_m + tolerance_m) above -= heights_[bin];
      const bool nearer =
          std::abs(shift_m) <= tolerance_m || std::abs(height_m) < std::abs(height_m - shift_m);
      if (std::abs(height_m) <= tolerance_m && nearer) in_place += heights_[bin];
    }
    const auto all = static_cast<double>(readings_);
    drift.below_share = static_cast<double>(below) / all;
    drift.above_share = static_cast<double>(above) / all;
    drift.in_place_share = static_cast<double>(in_place) / all;
  }
  [[nodiscard]] bool is_elsewhere() const noexcept {
    return readings_ > 0 &&
           static_cast<double>(below_) > kBelowShare * static_cast<double>(readings_);
  }
  /// Of the readings below the band.
  [[nodiscard]] double mean_below_m() const noexcept {
    return below_sum_m_ / static_cast<double>(std::max<std::size_t>(below_, 1));
  }
  [[nodiscard]] Vec3d place(const Vec3d& p) const noexcept {
    return {along_s_.dot(p), along_t_.dot(p), 1.0};
  }

 private:
  void look_at(int column, int row) noexcept {
    std::array<double, kSamples> heights{};
    std::size_t count = 0;
    Vec3d sum = Vec3d::Zero();
    for (int j = 0; j < kSide; ++j) {
      for (int i = 0; i < kSide; ++i) {
        const int u = (column * kSide + i) * frame_.depth.width / (kColumns * kSide);
        const int v = (row * kSide + j) * frame_.depth.height / (kRows * kSide);
        const std::uint16_t reading = frame_.depth.at(u, v);
        if (reading == 0) continue;
        ++readings_;
        const double z = reading * frame_.metres_per_unit;
        const Intrinsics& k = frame_.intrinsics;
        const Vec3d p((u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z);
        const double height_m = taught_.normal.dot(p) + taught_.offset_m;
        if (height_m < -kBand_m) {
          ++below_;
          below_sum_m_ += height_m;
        }
        if (std::abs(height_m) > kBand_m) continue;
        heights[count++] = height_m;
        ++heights_[static_cast<std::size_t>(std::lround(height_m / kBin_m) + kBinsToASide)];
        sum += p;
      }
    }
    if (count >= kMinSamples) add_if_flat(heights, count, sum / static_cast<double>(count));
  }

  void add_if_flat(std::array<double, kSamples>& heights, std::size_t count,
                   const Vec3d& centre) noexcept {
    std::sort(heights.begin(), heights.begin() + static_cast<std::ptrdiff_t>(count));
    const double tolerance_m = kUnevennessM + 2.0 * kStepPerSquareMetre * centre.z() * centre.z();
    // Half of the tile lies between these two; an edge of a part between them spreads them.
    if (heights[3 * count / 4] - heights[count / 4] > 2.0 * tolerance_m) return;
    const Vec3d place_m = place(centre);
    tiles_.push_back({place_m.x(), place_m.y(), heights[count / 2], tolerance_m});
  }

  const DepthFrame& frame_;
  const BeltPlane& taught_;
  Vec3d along_s_;
  Vec3d along_t_;
  Tiles tiles_;
  std::size_t readings_ = 0;
  std::size_t below_ = 0;
  double below_sum_m_ = 0.0;
  std::array<std::size_t, kBins> heights_{};
};

bool through(const Tile& a, const Tile& b, const Tile& c, Slope& slope) noexcept {
  Mat3d places;
  places << a.s, a.t, 1.0, b.s, b.t, 1.0, c.s, c.t, 1.0;
  if (std::abs(places.determinant()) < 1e-4) return false;
  slope.coefficients = places.inverse() * Vec3d(a.height_m, b.height_m, c.height_m);
  return true;
}

std::size_t agreeing(const Tiles& tiles, const Slope& slope) noexcept {
  return static_cast<std::size_t>(std::count_if(
      tiles.begin(), tiles.end(), [&](const Tile& tile) { return slope.holds(tile); }));
}

/// Nothing lies below a belt.
bool is_lowest(const Tiles& tiles, const Slope& slope) noexcept {
  const auto lower = std::count_if(tiles.begin(), tiles.end(), [&](const Tile& tile) {
    return tile.height_m < slope.at(tile) - tile.tolerance_m;
  });
  return static_cast<double>(lower) <= kLowerTiles * static_cast<double>(tiles.size());
}

/// The slope with the most agreeing tiles among those `next` proposes, and their number.
template <class Next>
std::size_t find_lowest(const Tiles& tiles, Next next, Slope& best) noexcept {
  std::size_t most = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Slope slope;
    if (!next(slope)) continue;
    const std::size_t count = agreeing(tiles, slope);
    if (count <= most || !is_lowest(tiles, slope)) continue;
    most = count;
    best = slope;
  }
  return most;
}

/// Least squares over the tiles that agree with `slope`.
void refine(const Tiles& tiles, Slope& slope) noexcept {
  Mat3d outer = Mat3d::Zero();
  Vec3d moment = Vec3d::Zero();
  for (const Tile& tile : tiles) {
    if (!slope.holds(tile)) continue;
    const Vec3d place(tile.s, tile.t, 1.0);
    outer += place * place.transpose();
    moment += place * tile.height_m;
  }
  slope.coefficients = outer.ldlt().solve(moment);
}

/// The mean height of the tiles that agree with a level.
double mean_height_m(const Tiles& tiles, const Slope& level) noexcept {
  double sum_m = 0.0;
  std::size_t count = 0;
  for (const Tile& tile : tiles) {
    if (!level.holds(tile)) continue;
    sum_m += tile.height_m;
    ++count;
  }
  return sum_m / static_cast<double>(std::max<std::size_t>(count, 1));
}

/// The belt as most of the tiles show it, or, where parts hide it, as some of them do.
void find_belt(const BeltView& view, const BeltPlane& taught, BeltDrift& drift) noexcept {
  const Tiles& tiles = view.tiles();
  // The optical axis meets the taught plane here; n points back to the camera, so n.z is negative.
  const double cosine = taught.normal.z();
  if (tiles.size() < kMinTiles || std::abs(cosine) < 0.1) return;
  Rng rng(1);
  const auto any = [&]() -> const Tile& {
    return tiles[rng.below(static_cast<std::uint32_t>(tiles.size()))];
  };
  const auto enough = [&](std::size_t count, double share) {
    return count >= kMinTiles &&
           static_cast<double>(count) >= share * static_cast<double>(tiles.size());
  };
  Slope plane;
  const auto tilted = [&](Slope& slope) { return through(any(), any(), any(), slope); };
  if (enough(find_lowest(tiles, tilted, plane), kMostOfTiles)) {
    refine(tiles, plane);
    refine(tiles, plane);
    drift.seen = true;
    drift.shift_m = plane.coefficients.dot(view.place({0.0, 0.0, -taught.offset_m / cosine}));
    drift.tilt_rad = std::atan(std::hypot(plane.coefficients.x(), plane.coefficients.y()));
    return;
  }
  Slope level;
  const auto parallel = [&](Slope& slope) {
    slope.coefficients = Vec3d(0.0, 0.0, any().height_m);
    return true;
  };
  if (!enough(find_lowest(tiles, parallel, level), kSomeOfTiles)) return;
  const double height_m = mean_height_m(tiles, level);
  // Higher up, they are as likely the tops of parts.
  drift.seen = std::abs(height_m) <= tiles[0].tolerance_m;
  if (drift.seen) drift.shift_m = height_m;
}

}  // namespace

BeltDrift measure_belt_drift(const DepthFrame& frame, const BeltPlane& taught) noexcept {
  BeltDrift drift;
  if (!taught.known || frame.depth.empty()) return drift;
  BeltView view(frame, taught);
  view.look();
  if (view.is_elsewhere()) {
    drift.seen = true;
    drift.shift_m = view.mean_below_m();
  } else {
    find_belt(view, taught, drift);
  }
  view.fill_shares(drift.shift_m, drift);
  return drift;
}

}  // namespace grapnel
