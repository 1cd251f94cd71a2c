#include "pipeline/preprocess/covariance_sampling.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

#include "pipeline/preprocess/compact.h"

namespace grapnel {
namespace {

/// What the points with a normal say about a small motion about their centroid.
class Constraints {
 public:
  explicit Constraints(const Surface& surface) noexcept : surface_(surface) {
    for (std::size_t i = 0; i < surface.size; ++i) {
      if (!surface.has_normal(i)) continue;
      centre_ += surface.point(i).cast<double>();
      ++count_;
    }
    if (count_ == 0) return;
    centre_ /= static_cast<double>(count_);
    double distance_m = 0.0;
    for (std::size_t i = 0; i < surface.size; ++i) {
      if (surface.has_normal(i)) distance_m += from_centre_m(i).norm();
    }
    // Points that all coincide say nothing about turns, at any scale.
    if (distance_m > 0.0) per_m_ = static_cast<double>(count_) / distance_m;
    for (std::size_t i = 0; i < surface.size; ++i) {
      if (!surface.has_normal(i)) continue;
      const Vec6d v = of_point(i);
      information_ += v * v.transpose();
    }
  }

  /// Of a point with a normal: turn, then shift.
  [[nodiscard]] Vec6d of_point(std::size_t i) const noexcept {
    const Vec3d normal = surface_.normal(i).cast<double>();
    Vec6d v;
    v.head<3>() = (per_m_ * from_centre_m(i)).cross(normal);
    v.tail<3>() = normal;
    return v;
  }
  [[nodiscard]] const Mat6d& information() const noexcept { return information_; }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }

 private:
  [[nodiscard]] Vec3d from_centre_m(std::size_t i) const noexcept {
    return surface_.point(i).cast<double>() - centre_;
  }

  const Surface& surface_;
  Vec3d centre_ = Vec3d::Zero();
  double per_m_ = 1.0;
  std::size_t count_ = 0;
  Mat6d information_ = Mat6d::Zero();
};

}  // namespace

FieldTable covariance_sampling_fields() noexcept {
  using P = CovarianceSamplingParams;
  static constexpr std::array kFields = {
      number_field<&P::points>("points", "", 1, 10000000, "points left"),
  };
  return kFields;
}

void CovarianceSampling::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  keep_ = arena.take<std::uint8_t>(points);
  entries_ = arena.take<Entry>(points);
  for (std::span<std::uint32_t>& list : by_worth_) list = arena.take<std::uint32_t>(points);
}

Result<std::size_t> CovarianceSampling::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Decimate); !status.ok()) {
    return status.error();
  }
  const Constraints constraints(surface);
  if (constraints.count() == 0) return Error{Code::TooFewPoints, Stage::Decimate, 0};
  const Mat6d motions =
      Eigen::SelfAdjointEigenSolver<Mat6d>(constraints.information()).eigenvectors();
  for (std::size_t m = 0; m < kMotions; ++m) {
    const Vec6d motion = motions.col(static_cast<Eigen::Index>(m));
    std::size_t count = 0;
    for (std::size_t i = 0; i < surface.size; ++i) {
      if (!surface.has_normal(i)) continue;
      entries_[count++] = {std::abs(constraints.of_point(i).dot(motion)),
                           static_cast<std::uint32_t>(i)};
    }
    std::sort(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(count),
              [](const Entry& a, const Entry& b) {
                return a.worth != b.worth ? a.worth > b.worth : a.point < b.point;
              });
    for (std::size_t k = 0; k < count; ++k) by_worth_[m][k] = entries_[k].point;
  }
  std::fill_n(keep_.begin(), surface.size, std::uint8_t{0});
  std::array<double, kMotions> said{};
  std::array<std::size_t, kMotions> next{};
  const std::size_t wanted =
      std::min(static_cast<std::size_t>(params_.points), constraints.count());
  for (std::size_t taken = 0; taken < wanted; ++taken) {
    const auto least =
        static_cast<std::size_t>(std::min_element(said.begin(), said.end()) - said.begin());
    while (keep_[by_worth_[least][next[least]]] != 0) ++next[least];
    const std::uint32_t point = by_worth_[least][next[least]];
    keep_[point] = 1;
    const Vec6d v = constraints.of_point(point);
    for (std::size_t m = 0; m < kMotions; ++m) {
      const double part = v.dot(motions.col(static_cast<Eigen::Index>(m)));
      said[m] += part * part;
    }
  }
  return keep_points(surface, keep_);
}

double covariance_condition(const Surface& surface) noexcept {
  const Constraints constraints(surface);
  if (constraints.count() == 0) return 0.0;
  const Vec6d values =
      Eigen::SelfAdjointEigenSolver<Mat6d>(constraints.information(), Eigen::EigenvaluesOnly)
          .eigenvalues();
  return values[0] > 0.0 ? values[5] / values[0] : std::numeric_limits<double>::infinity();
}

}  // namespace grapnel
