#include "workbench/views/joint_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace grapnel {
namespace {

constexpr int kIterations = 25;
// The gate begins this much wider and narrows.
constexpr double kFirstGate = 2.0;
constexpr double kNarrow = 0.85;
// Normals of partners differ by at most 35 degrees: 30, and the sensor's own noise.
constexpr float kCosNormal = 0.82F;
// Fewer partners than this do not tie two views.
constexpr std::size_t kFewestPartners = 60;
// Focal lengths of consumer cameras are known to about this before anybody calibrates.
constexpr double kFocalPrior = 0.02;
constexpr double kSigmas = 3.0;
// Structured light correlates windows of about this many readings (ALGORITHMS: 30 to 80 pixels), of
// which the selection below keeps but one in a few.
constexpr double kReadingsPerError = 10.0;
constexpr double kLeastStep = 1e-8;

/// A view's samples under a focal factor, found by pixel.
class PixelSurface {
 public:
  PixelSurface(const JointView& view, double lateral)
      : camera_(view.intrinsics), samples_(view.samples) {
    camera_.fx /= lateral;
    camera_.fy /= lateral;
    apply_focal_factor(1.0 / lateral, samples_);
    sample_at_.assign(
        static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height), -1);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const int pixel = pixel_of(samples_[i].point);
      if (pixel >= 0) sample_at_[static_cast<std::size_t>(pixel)] = static_cast<std::int32_t>(i);
    }
  }

  [[nodiscard]] const std::vector<SurfaceSample>& samples() const { return samples_; }
  /// The sample that the camera has where `point` would appear; nullptr = none.
  [[nodiscard]] const SurfaceSample* partner(const Vec3f& point) const {
    const int pixel = pixel_of(point);
    if (pixel < 0) return nullptr;
    const std::int32_t found = sample_at_[static_cast<std::size_t>(pixel)];
    return found < 0 ? nullptr : &samples_[static_cast<std::size_t>(found)];
  }

 private:
  [[nodiscard]] int pixel_of(const Vec3f& p) const {
    if (!(p.z() > 0.0F)) return -1;
    const double u = std::floor(camera_.fx * static_cast<double>(p.x() / p.z()) + camera_.cx + 0.5);
    const double v = std::floor(camera_.fy * static_cast<double>(p.y() / p.z()) + camera_.cy + 0.5);
    if (!(u >= 0.0 && v >= 0.0 && u < camera_.width && v < camera_.height)) return -1;
    return static_cast<int>(v) * camera_.width + static_cast<int>(u);
  }

  Intrinsics camera_;
  std::vector<SurfaceSample> samples_;
  std::vector<std::int32_t> sample_at_;
};

/// A point of view `from` on the tangent plane of a sample of view `to`.
struct Partners {
  std::size_t from = 0;
  std::size_t to = 0;
  Vec3d point = Vec3d::Zero();    // of `from`, in its frame
  Vec3d partner = Vec3d::Zero();  // of `to`, in its frame
  Vec3d normal = Vec3d::Zero();   // of `to`, in its frame
  double weight = 0.0;
};

class Fit {
 public:
  Fit(const std::vector<JointView>& views, const JointFitOptions& options)
      : views_(views), options_(options) {
    for (const JointView& view : views) poses_.push_back(view.world_from_view);
  }

  JointFit run() {
    if (options_.fit_focal) {
      settle(true);
      if (std::abs(lateral_ - 1.0) > kSigmas * lateral_sigma_) return answer();
    }
    lateral_ = 1.0;
    settle(false);
    return answer();
  }

 private:
  void settle(bool focal) {
    double gate_m = kFirstGate * options_.gate_m;
    for (int i = 0; i < kIterations; ++i) {
      find_partners(gate_m);
      const double step = solve(focal);
      const bool narrow = gate_m <= options_.gate_m;
      if (narrow && step < kLeastStep) break;
      gate_m = std::max(options_.gate_m, kNarrow * gate_m);
    }
  }

  void find_partners(double gate_m) {
    partners_.clear();
    std::vector<PixelSurface> surfaces;
    for (const JointView& view : views_) surfaces.emplace_back(view, lateral_);
    for (std::size_t from = 0; from < views_.size(); ++from) {
      for (std::size_t to = 0; to < views_.size(); ++to) {
        if (from != to) find_between(surfaces, from, to, gate_m);
      }
    }
  }

  void find_between(const std::vector<PixelSurface>& surfaces, std::size_t from, std::size_t to,
                    double gate_m) {
    const std::vector<SurfaceSample>& samples = surfaces[from].samples();
    const std::size_t step = std::max<std::size_t>(1, samples.size() / options_.samples);
    const Pose to_from = poses_[to].inverse() * poses_[from];
    const std::size_t before = partners_.size();
    for (std::size_t i = 0; i < samples.size(); i += step) {
      const Vec3d p = to_from * samples[i].point.cast<double>();
      const SurfaceSample* const partner = surfaces[to].partner(p.cast<float>());
      if (partner == nullptr) continue;
      const Vec3f turned = (to_from.linear() * samples[i].normal.cast<double>()).cast<float>();
      if (turned.dot(partner->normal) < kCosNormal) continue;
      const Vec3d normal = partner->normal.cast<double>();
      const Vec3d q = partner->point.cast<double>();
      const double off_m = normal.dot(p - q);
      if (std::abs(off_m) > gate_m) continue;
      const double variance_m2 =
          1.0 / static_cast<double>(samples[i].weight) + 1.0 / static_cast<double>(partner->weight);
      // Tukey's biweight: nothing jumps at the gate.
      const double share = 1.0 - (off_m / gate_m) * (off_m / gate_m);
      partners_.push_back({from, to, samples[i].point.cast<double>(), q, normal,
                           share * share / (variance_m2 * kReadingsPerError)});
    }
    if (partners_.size() - before < kFewestPartners) partners_.resize(before);
  }

  /// Derivatives of one residual by the motions of both views in their own frames, and by the
  /// lateral scale.
  struct Row {
    Vec6d by_from;
    Vec6d by_to;
    double by_lateral = 0.0;
    double off_m = 0.0;
  };
  [[nodiscard]] Row row_of(const Partners& pair) const {
    const Pose to_from = poses_[pair.to].inverse() * poses_[pair.from];
    const Vec3d y = to_from * pair.point;
    const Vec3d back = to_from.linear().transpose() * pair.normal;
    Row row;
    row.off_m = pair.normal.dot(y - pair.partner);
    row.by_from << back, pair.point.cross(back);
    row.by_to << -pair.normal, -y.cross(pair.normal);
    row.by_lateral = (back.head<2>().dot(pair.point.head<2>()) -
                      pair.normal.head<2>().dot(pair.partner.head<2>())) /
                     lateral_;
    return row;
  }

  /// Gauss-Newton's step; its largest part.
  double solve(bool focal) {
    const auto poses = static_cast<Eigen::Index>(6 * (views_.size() - 1));
    const Eigen::Index size = poses + (focal ? 1 : 0);
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    double square_m2 = 0.0;
    for (const Partners& pair : partners_) {
      const Row row = row_of(pair);
      square_m2 += row.off_m * row.off_m;
      add(pair, row, focal, hessian, gradient);
    }
    rms_m_ = partners_.empty() ? 0.0 : std::sqrt(square_m2 / static_cast<double>(partners_.size()));
    if (focal) {
      const double prior = 1.0 / (kFocalPrior * kFocalPrior);
      hessian(poses, poses) += prior;
      gradient[poses] += prior * (lateral_ - 1.0);
    }
    // A view without partners stays where it is.
    hessian.diagonal().array() += 1e-6;
    const Eigen::LDLT<Eigen::MatrixXd> ldlt = hessian.ldlt();
    const Eigen::VectorXd step = -ldlt.solve(gradient);
    if (!step.allFinite()) return 0.0;
    for (std::size_t view = 1; view < views_.size(); ++view) {
      move(poses_[view], step.segment<6>(static_cast<Eigen::Index>(6 * (view - 1))));
    }
    if (focal) {
      lateral_ += step[poses];
      Eigen::VectorXd unit = Eigen::VectorXd::Zero(size);
      unit[poses] = 1.0;
      lateral_sigma_ = std::sqrt(std::max(0.0, ldlt.solve(unit)[poses]));
    }
    return step.size() > 0 ? step.lpNorm<Eigen::Infinity>() : 0.0;
  }

  void add(const Partners& pair, const Row& row, bool focal, Eigen::MatrixXd& hessian,
           Eigen::VectorXd& gradient) const {
    const auto column = [](std::size_t view) { return static_cast<Eigen::Index>(6 * view) - 6; };
    const struct {
      std::size_t view;
      const Vec6d& by;
    } ends[2] = {{pair.from, row.by_from}, {pair.to, row.by_to}};
    const Eigen::Index last = hessian.rows() - 1;
    for (const auto& a : ends) {
      if (a.view == 0) continue;
      gradient.segment<6>(column(a.view)) += pair.weight * row.off_m * a.by;
      if (focal) {
        const Vec6d mixed = pair.weight * row.by_lateral * a.by;
        hessian.block<6, 1>(column(a.view), last) += mixed;
        hessian.block<1, 6>(last, column(a.view)) += mixed.transpose();
      }
      for (const auto& b : ends) {
        if (b.view == 0) continue;
        hessian.block<6, 6>(column(a.view), column(b.view)) +=
            pair.weight * a.by * b.by.transpose();
      }
    }
    if (!focal) return;
    hessian(last, last) += pair.weight * row.by_lateral * row.by_lateral;
    gradient[last] += pair.weight * row.off_m * row.by_lateral;
  }

  static void move(Pose& pose, const Vec6d& step) {
    Pose motion = Pose::Identity();
    motion.linear() = rotation_from_vector(step.tail<3>());
    motion.translation() = step.head<3>();
    pose = pose * motion;
    pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  }

  [[nodiscard]] JointFit answer() const {
    return {poses_, 1.0 / lateral_, lateral_sigma_, rms_m_, partners_.size()};
  }

  const std::vector<JointView>& views_;
  const JointFitOptions& options_;
  std::vector<Pose> poses_;
  std::vector<Partners> partners_;
  double lateral_ = 1.0;  // x and y times this: one over the focal factor
  double lateral_sigma_ = 0.0;
  double rms_m_ = 0.0;
};

}  // namespace

JointFit fit_together(const std::vector<JointView>& views, const JointFitOptions& options) {
  return Fit(views, options).run();
}

void apply_focal_factor(double focal_factor, std::vector<SurfaceSample>& samples) {
  if (focal_factor == 1.0) return;
  const auto factor = static_cast<float>(focal_factor);
  for (SurfaceSample& sample : samples) {
    sample.point.head<2>() /= factor;
    sample.normal.head<2>() *= factor;
    sample.normal.normalize();
  }
}

}  // namespace grapnel
