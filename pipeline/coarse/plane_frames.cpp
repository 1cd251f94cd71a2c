#include "pipeline/coarse/plane_frames.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"

namespace grapnel {
namespace {

// Planes nearer to parallel than 25 degrees make no edge.
constexpr double kCosParallel = 0.9;
constexpr double kSteep = 0.5;

/// Columns: the first direction, the edge, and what completes them.
Mat3d frame_of(const Vec3d& first, const Vec3d& second) noexcept {
  Mat3d frame;
  const Vec3d edge = first.cross(second).normalized();
  frame << first, edge, first.cross(edge);
  return frame;
}

PlanePatches::Interval both(const PlanePatches& patches, const Surface& surface, std::size_t a,
                            std::size_t b, const Vec3d& direction) noexcept {
  const PlanePatches::Interval on_a = patches.extent(surface, a, direction);
  const PlanePatches::Interval on_b = patches.extent(surface, b, direction);
  return {std::min(on_a.low_m, on_b.low_m), std::max(on_a.high_m, on_b.high_m)};
}

}  // namespace

FieldTable plane_frames_fields() noexcept {
  using P = PlaneFramesParams;
  static constexpr std::array kFields = {
      number_field<&P::trials>("trials", "", 1, 10000, "points tried for each plane"),
      number_field<&P::thickness_ratio>("thickness_ratio", "spacings", 0.01, 100.0,
                                        "half thickness of a plane"),
      number_field<&P::max_normal_angle_rad>("max_normal_angle_rad", "rad", 0.01, 1.5,
                                             "of a point's normal from its plane's"),
      number_field<&P::min_share>("min_share", "", 0.001, 1.0, "of all points, of a plane"),
      number_field<&P::max_angle_rad>("max_angle_rad", "rad", 0.01, 1.0,
                                      "by which angles between planes may differ"),
      number_field<&P::ratings>("ratings", "", 1, 1000000, "poses looked at, at most"),
      number_field<&P::quick_samples>("quick_samples", "", 16, 4096, "samples of a first rating"),
  };
  return kFields;
}

void PlaneFrames::reserve(Arena& arena, const Limits& limits) {
  source_.reserve(arena, std::max(limits.max_model_points, limits.max_points));
  target_.reserve(arena, std::max(limits.max_model_points, limits.max_points));
  finalists_.reserve(arena);
}

Status PlaneFrames::generate(const PairView& pair, const Correspondences&, Rng& rng,
                             Hypotheses& hypotheses) noexcept {
  if (pair.score == nullptr) return Error{Code::BadParameter, Stage::Coarse, 0};
  const PlanePatchParams patches = {params_.trials, params_.thickness_ratio,
                                    params_.max_normal_angle_rad, params_.min_share};
  source_.find(*pair.source, patches, rng.split(1));
  target_.find(*pair.target, patches, rng.split(2));
  finalists_.begin(pair, params_.quick_samples, params_.ratings);
  try_edges(pair);
  try_faces(pair);
  return finalists_.conclude(hypotheses);
}

void PlaneFrames::try_edges(const PairView& pair) noexcept {
  const auto targets = target_.patches();
  const auto sources = source_.patches();
  const double tolerance = params_.max_angle_rad;  // of a cosine: at most its angle's
  for (std::size_t a = 0; a < targets.size(); ++a) {
    for (std::size_t b = a + 1; b < targets.size(); ++b) {
      const double cosine = targets[a].normal.dot(targets[b].normal);
      if (std::fabs(cosine) > kCosParallel) continue;
      for (std::size_t i = 0; i < sources.size(); ++i) {
        for (std::size_t j = 0; j < sources.size(); ++j) {
          if (i == j) continue;
          const double other = sources[i].normal.dot(sources[j].normal);
          if (std::fabs(other) > kCosParallel || std::fabs(cosine - other) > tolerance) continue;
          if (!try_edge(pair, {a, b}, {i, j})) return;
        }
      }
    }
  }
}

bool PlaneFrames::third_plane(const Mat3d& rotation, Edge target, const Vec3d& edge, Vec3d& row,
                              double& right_m) const noexcept {
  const double cos_angle = math::cos(params_.max_angle_rad);
  const auto targets = target_.patches();
  for (std::size_t c = 0; c < targets.size(); ++c) {
    if (c == target.first || c == target.second) continue;
    if (std::fabs(targets[c].normal.dot(edge)) < kSteep) continue;
    for (const PlanePatch& plane : source_.patches()) {
      if (targets[c].normal.dot(rotation * plane.normal) < cos_angle) continue;
      row = targets[c].normal;
      right_m = targets[c].offset_m - plane.offset_m;
      return true;
    }
  }
  return false;
}

bool PlaneFrames::try_edge(const PairView& pair, Edge target, Edge source) noexcept {
  const PlanePatch& a = target_.patches()[target.first];
  const PlanePatch& b = target_.patches()[target.second];
  const PlanePatch& i = source_.patches()[source.first];
  const PlanePatch& j = source_.patches()[source.second];
  const Mat3d target_frame = frame_of(a.normal, b.normal);
  const Mat3d source_frame = frame_of(i.normal, j.normal);
  Pose pose = Pose::Identity();
  pose.linear() = target_frame * source_frame.transpose();
  const Vec3d edge = target_frame.col(1);
  // n·(R p + t) = offset, for each pair of planes.
  Mat3d rows;
  rows << a.normal.transpose(), b.normal.transpose(), edge.transpose();
  Vec3d right(a.offset_m - i.offset_m, b.offset_m - j.offset_m, 0.0);
  Vec3d row;
  if (third_plane(pose.linear(), target, edge, row, right.z())) {
    Mat3d corner = rows;
    corner.row(2) = row.transpose();
    pose.translation() = corner.inverse() * right;
    if (!finalists_.offer(pose)) return false;
  }
  const PlanePatches::Interval seen =
      both(target_, *pair.target, target.first, target.second, edge);
  const PlanePatches::Interval own =
      both(source_, *pair.source, source.first, source.second, source_frame.col(1));
  const Mat3d inverse = rows.inverse();
  for (const double along_m : {seen.low_m - own.low_m, seen.high_m - own.high_m,
                               0.5 * (seen.low_m + seen.high_m - own.low_m - own.high_m)}) {
    right.z() = along_m;
    pose.translation() = inverse * right;
    if (!finalists_.offer(pose)) return false;
  }
  return true;
}

void PlaneFrames::try_faces(const PairView& pair) noexcept {
  for (std::size_t i = 0; i < source_.patches().size(); ++i) {
    source_faces_[i] = source_.rectangle(*pair.source, i);
  }
  for (std::size_t a = 0; a < target_.patches().size(); ++a) {
    target_faces_[a] = target_.rectangle(*pair.target, a);
    for (std::size_t i = 0; i < source_.patches().size(); ++i) {
      if (!try_face(a, i)) return;
    }
  }
}

bool PlaneFrames::try_face(std::size_t target, std::size_t source) noexcept {
  const PlanePatches::Rectangle& seen = target_faces_[target];
  const PlanePatches::Rectangle& own = source_faces_[source];
  const Vec3d& normal = target_.patches()[target].normal;
  for (int turn = 0; turn < 4; ++turn) {
    const bool sideways = turn % 2 == 1;
    const double sign = turn < 2 ? 1.0 : -1.0;
    const Vec3d along = sign * (sideways ? seen.across : seen.along);
    const Vec3d across = normal.cross(along);
    Pose pose = Pose::Identity();
    pose.linear() = normal * source_.patches()[source].normal.transpose() +
                    along * own.along.transpose() + across * own.across.transpose();
    const Vec3d middle = seen.middle - pose.linear() * own.middle;
    const double free_along_m = 0.5 * ((sideways ? seen.width_m : seen.length_m) - own.length_m);
    const double free_across_m = 0.5 * ((sideways ? seen.length_m : seen.width_m) - own.width_m);
    constexpr std::array<std::array<int, 2>, 5> kCorners = {
        {{0, 0}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};
    for (const auto& [u, v] : kCorners) {
      pose.translation() = middle + u * free_along_m * along + v * free_across_m * across;
      if (!finalists_.offer(pose)) return false;
    }
  }
  return true;
}

}  // namespace grapnel
