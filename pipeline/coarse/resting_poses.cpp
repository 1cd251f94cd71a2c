#include "pipeline/coarse/resting_poses.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"
#include "pipeline/coarse/pose_score.h"
#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {
namespace {

constexpr std::size_t kDirections = 256;
constexpr std::size_t kMostPoints = 600;
// A side's reach is the least of all directions within 20 degrees.
constexpr double kCosAround = 0.94;
// Two sides differ by more than 8 degrees.
constexpr double kCosSame = 0.99;
constexpr std::size_t kRefits = 5;
// What a part rests on, diameters above its lowest point: thick at first, as the direction is
// several degrees off.
constexpr std::array<double, kRefits> kContact = {0.08, 0.06, 0.04, 0.02, 0.02};
// Narrower contacts are a line or a point, diameters.
constexpr double kNarrow = 0.03;

/// The i-th of kDirections, evenly spread: a Fibonacci spiral on the sphere.
Vec3d direction(std::size_t i) noexcept {
  constexpr double kGoldenAngle = 2.39996322972865332;
  const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / kDirections;
  const double radius = std::sqrt(std::max(0.0, 1.0 - z * z));
  const double angle_rad = kGoldenAngle * static_cast<double>(i);
  return {radius * math::cos(angle_rad), radius * math::sin(angle_rad), z};
}

double reach_along(const Surface& source, const Vec3d& down, std::size_t step) noexcept {
  const Vec3f along = down.cast<float>();
  float reach_m = -1e30F;
  for (std::size_t i = 0; i < source.size; i += step) {
    reach_m = std::max(reach_m, along.dot(source.point(i)));
  }
  return static_cast<double>(reach_m);
}

/// Turns the direction until the part stands flat: onto the plane through its contact, or, where
/// that is a line, square to it.
Vec3d settled(const Surface& source, Vec3d down, double diameter_m) noexcept {
  for (const double contact : kContact) {
    const double lowest_m = reach_along(source, down, 1) - contact * diameter_m;
    Vec3d sum = Vec3d::Zero();
    double count = 0.0;
    for (std::size_t i = 0; i < source.size; ++i) {
      const Vec3d p = source.point(i).cast<double>();
      if (down.dot(p) < lowest_m) continue;
      sum += p;
      count += 1.0;
    }
    const Vec3d mean = sum / count;
    Symmetric3 moments;
    for (std::size_t i = 0; i < source.size; ++i) {
      const Vec3d p = source.point(i).cast<double>();
      if (down.dot(p) < lowest_m) continue;
      const Vec3d off = p - mean;
      moments.add(off.x(), off.y(), off.z());
    }
    const Eigen3 shape = eigen_symmetric3(moments);
    const double narrow_m2 = kNarrow * kNarrow * diameter_m * diameter_m * count;
    Vec3d next = down;
    if (shape.values[1] > narrow_m2) {
      next = shape.vectors.col(0);
    } else if (shape.values[2] > narrow_m2) {
      const Vec3d line = shape.vectors.col(2);
      next = (down - down.dot(line) * line).normalized();
    }
    if (!next.allFinite() || next.squaredNorm() < 0.5) return down;
    down = next.dot(down) < 0.0 ? Vec3d(-next) : next;
  }
  return down;
}

}  // namespace

FieldTable resting_poses_fields() noexcept {
  using P = RestingPosesParams;
  static constexpr std::array kFields = {
      number_field<&P::yaws>("yaws", "", 1, 720, "turns tried about the ground's normal"),
      number_field<&P::slides>("slides", "", 0, 20,
                               "shifts along the ground toward the measured surface"),
      number_field<&P::quick_samples>("quick_samples", "", 16, 4096, "samples of a first rating"),
  };
  return kFields;
}

void RestingPoses::reserve(Arena& arena, const Limits&) {
  reach_m_ = arena.take<double>(kDirections);
  finalists_.reserve(arena);
  learned_ = 0;
}

void RestingPoses::find_sides(const Surface& source) noexcept {
  sides_.clear();
  if (source.size == 0) return;
  Vec3f low = Vec3f::Constant(1e30F);
  Vec3f high = -low;
  for (std::size_t i = 0; i < source.size; ++i) {
    low = low.cwiseMin(source.point(i));
    high = high.cwiseMax(source.point(i));
  }
  const Vec3d centre = (0.5F * (low + high)).cast<double>();
  const auto diameter_m = static_cast<double>((high - low).norm());
  const std::size_t step = source.size / kMostPoints + 1;
  for (std::size_t i = 0; i < kDirections; ++i) {
    reach_m_[i] = reach_along(source, direction(i), step) - direction(i).dot(centre);
  }
  for (std::size_t i = 0; i < kDirections && !sides_.full(); ++i) {
    bool least = true;
    for (std::size_t k = 0; least && k < kDirections; ++k) {
      least = reach_m_[k] >= reach_m_[i] || direction(i).dot(direction(k)) < kCosAround;
    }
    if (!least) continue;
    Side side;
    side.down = settled(source, direction(i), diameter_m);
    const auto same = [&](const Side& other) { return other.down.dot(side.down) > kCosSame; };
    if (std::any_of(sides_.begin(), sides_.end(), same)) continue;
    side.reach_m = reach_along(source, side.down, 1);
    sides_.push_back(side);
  }
}

Vec3d RestingPoses::seen_middle(const Surface& source, const Mat3d& rotation,
                                const Vec3d& toward_camera) const noexcept {
  const std::size_t step = source.size / 200 + 1;
  const Vec3f toward = (rotation.transpose() * toward_camera).cast<float>();
  Vec3f sum = Vec3f::Zero();
  float weight = 0.0F;
  for (std::size_t i = 0; i < source.size; i += step) {
    const float cosine = source.normal(i).dot(toward);
    if (cosine <= 0.0F) continue;
    sum += cosine * source.point(i);
    weight += cosine;
  }
  if (!(weight > 0.0F)) return Vec3d::Zero();
  return rotation * (sum / weight).cast<double>();
}

void RestingPoses::try_side(const PairView& pair, const Side& side, const Vec3d& middle) noexcept {
  const Ground& ground = *pair.ground;
  const Mat3d own = frame_about(side.down);
  const Mat3d seen = frame_about(-ground.normal);
  const double up_m = side.reach_m - ground.offset_m;
  const auto along_ground = [&](const Vec3d& way) -> Vec3d {
    return way - ground.normal.dot(way) * ground.normal;
  };
  for (std::size_t yaw = 0; yaw < params_.yaws; ++yaw) {
    const double angle_rad =
        2.0 * math::kPi * static_cast<double>(yaw) / static_cast<double>(params_.yaws);
    Mat3d about = Mat3d::Identity();
    about(1, 1) = about(2, 2) = math::cos(angle_rad);
    about(2, 1) = math::sin(angle_rad);
    about(1, 2) = -about(2, 1);
    Pose pose = Pose::Identity();
    pose.linear() = seen * about * own.transpose();
    const Vec3d shift = middle - seen_middle(*pair.source, pose.linear(), -middle.normalized());
    pose.translation() = along_ground(shift) + up_m * ground.normal;
    finalists_.offer(pose);
    for (std::size_t i = 0; i < params_.slides; ++i) {
      const Pose slid = pair.score->slid(pose, params_.quick_samples);
      pose.translation() += along_ground(slid.translation() - pose.translation());
    }
    if (params_.slides > 0) finalists_.offer(pose);
  }
}

Status RestingPoses::generate(const PairView& pair, const Correspondences&, Rng&,
                              Hypotheses& hypotheses) noexcept {
  if (pair.score == nullptr) return Error{Code::BadParameter, Stage::Coarse, 0};
  if (pair.ground == nullptr || !pair.ground->known() || pair.target->size == 0) {
    return Error{Code::NoConsensus, Stage::Coarse, 0};
  }
  if (const std::uint64_t hash = hash_points(*pair.source); hash != learned_) {
    find_sides(*pair.source);
    learned_ = hash;
  }
  finalists_.begin(pair, params_.quick_samples, SIZE_MAX);
  const Vec3d middle = centroid(*pair.target);
  for (const Side& side : sides_.span()) try_side(pair, side, middle);
  return finalists_.conclude(hypotheses);
}

}  // namespace grapnel
