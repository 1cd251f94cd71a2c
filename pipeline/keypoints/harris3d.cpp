#include "pipeline/keypoints/harris3d.h"

#include <algorithm>
#include <cmath>

#include "pipeline/keypoints/strongest.h"

namespace grapnel {

FieldTable harris_fields() noexcept {
  static constexpr std::array<std::string_view, 2> kEngines = {"fast", "reference"};
  static constexpr std::array<std::string_view, 5> kResponses = {"harris", "noble", "lowe",
                                                                 "tomasi", "curvature"};
  using P = HarrisParams;
  static constexpr std::array kFields = {
      choice_field<&P::engine>("engine", kEngines, "fast, or plain loops in double"),
      choice_field<&P::response>("response", kResponses,
                                 "measure of the normals' spread; the first three agree"),
      number_field<&P::radius_m>("radius_m", "m", 0.0, 10.0,
                                 "sphere of the normals; 0 = radius_ratio spacings (PCL: 0.01)"),
      number_field<&P::radius_ratio>("radius_ratio", "spacings", 1.0, 50.0,
                                     "sphere of the normals in spacings of the surface"),
      number_field<&P::threshold>("threshold", "", -1.0, 1.0, "least response (PCL: 0)"),
      bool_field<&P::suppress>("suppress", "only the largest response within the radius"),
      bool_field<&P::refine>("refine", "moves keypoints to where their tangent planes meet"),
  };
  return kFields;
}

namespace {

double determinant(const Symmetric3& c) noexcept {
  return c.xx * c.yy * c.zz + 2.0 * c.xy * c.xz * c.yz - c.xz * c.xz * c.yy - c.xy * c.xy * c.zz -
         c.yz * c.yz * c.xx;
}

/// Of C, the covariance of normals (divided by their number). 0 where the trace is 0, as PCL.
double response_of(HarrisResponse kind, const Symmetric3& c) noexcept {
  const double trace = c.xx + c.yy + c.zz;
  if (!(trace > 0.0)) return 0.0;
  switch (kind) {
    case HarrisResponse::Harris:
      return 0.04 + determinant(c) - 0.04 * trace * trace;
    case HarrisResponse::Noble:
      return determinant(c) / trace;
    case HarrisResponse::Lowe:
      return determinant(c) / (trace * trace);
    case HarrisResponse::Tomasi:
      return eigen_symmetric3(c).values[0];
    case HarrisResponse::Curvature:
      break;
  }
  return 0.0;
}

/// Smallest eigenvalue over their sum.
float variation(const Symmetric3& covariance) noexcept {
  const Vec3d e = eigenvalues_symmetric3(covariance);
  const double sum = e.sum();
  return sum > 0.0 ? static_cast<float>(std::max(0.0, e[0]) / sum) : 0.0F;
}

}  // namespace

void HarrisDetector::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  sums_.reserve(arena, limits);
  maxima_.reserve(arena, limits);
  response_ = arena.take<float>(points);
  for (std::span<float>& plane : eigenvalues_) {
    plane = arena.take<float>(points + SphereSums::kPadding);
  }
}

void HarrisDetector::respond_fast(const Surface& surface) noexcept {
  const auto entry = [&](std::size_t k, std::size_t i) {
    return static_cast<double>(sums_.product(k)[i]);
  };
  const auto products = [&](std::size_t i) {
    return Symmetric3{entry(0, i), entry(1, i), entry(2, i), entry(3, i), entry(4, i), entry(5, i)};
  };
  if (params_.response == HarrisResponse::Curvature) {
    sums_.scatter(true);
    for (std::size_t i = 0; i < surface.size; ++i) {
      const double n = static_cast<double>(sums_.count()[i]);
      const auto mean = [&](std::size_t axis) {
        return static_cast<double>(sums_.first(axis)[i]) / n;
      };
      response_[i] = variation(products(i).over(n).about({mean(0), mean(1), mean(2)}));
    }
    return;
  }
  sums_.normals(false);
  if (params_.response == HarrisResponse::Tomasi) {
    kernels::eigenvalues(sums_.products(), surface.size, eigenvalues_[0].data(),
                         eigenvalues_[1].data(), eigenvalues_[2].data());
    for (std::size_t i = 0; i < surface.size; ++i) {
      const float count = sums_.count()[i];
      response_[i] = count > 0.0F ? eigenvalues_[0][i] / count : 0.0F;
    }
    return;
  }
  for (std::size_t i = 0; i < surface.size; ++i) {
    const double count = std::max(1.0, static_cast<double>(sums_.count()[i]));
    response_[i] = static_cast<float>(response_of(params_.response, products(i).over(count)));
  }
}

void HarrisDetector::respond_plainly(const Surface& surface, double radius_m) noexcept {
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Neighbourhood around = sums_.search().within(i, static_cast<float>(radius_m));
    const Vec3d own = surface.point(i).cast<double>();
    Symmetric3 normals;
    Symmetric3 points;
    Vec3d mean = Vec3d::Zero();
    double count = 0.0;
    for (const std::int32_t index : around.index) {
      const auto other = static_cast<std::size_t>(index);
      const Vec3d d = surface.point(other).cast<double>() - own;
      points.add(d.x(), d.y(), d.z());
      mean += d;
      if (!surface.has_normal(other)) continue;
      const Vec3d n = surface.normal(other).cast<double>();
      normals.add(n.x(), n.y(), n.z());
      count += 1.0;
    }
    if (params_.response != HarrisResponse::Curvature) {
      const double by = std::max(1.0, count);
      response_[i] = static_cast<float>(response_of(params_.response, normals.over(by)));
      continue;
    }
    const auto n = static_cast<double>(around.size());
    mean /= n;
    response_[i] = variation(points.over(n).about(mean));
  }
}

/// Solves sum(n nᵀ) x = sum(n nᵀ q) over the sphere about the corner until it rests. Relative to
/// the corner, which keeps the digits PCL loses far from the origin. Where the planes do not fix a
/// point (condition above 1e4, PCL's limit) the corner stays.
void HarrisDetector::refine(const Surface& surface, double radius_m,
                            KeypointSet& keypoints) noexcept {
  constexpr int kMaxIterations = 10;
  constexpr double kRestSquared_m2 = 1e-6;
  constexpr double kMinConditioning = 1e-4;
  for (Keypoint& keypoint : keypoints) {
    const Vec3d start = surface.point(static_cast<std::size_t>(keypoint.point)).cast<double>();
    Vec3d corner = start;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      const Neighbourhood around =
          sums_.search().within(Vec3f(corner.cast<float>()), static_cast<float>(radius_m));
      Symmetric3 sum;
      Vec3d right = Vec3d::Zero();
      for (const std::int32_t index : around.index) {
        const auto i = static_cast<std::size_t>(index);
        if (!surface.has_normal(i)) continue;
        const Vec3d n = surface.normal(i).cast<double>();
        sum.add(n.x(), n.y(), n.z());
        right += n * n.dot(surface.point(i).cast<double>() - corner);
      }
      const Eigen3 e = eigen_symmetric3(sum);
      if (!(e.values[0] > kMinConditioning * e.values[2])) break;
      Vec3d step = Vec3d::Zero();
      for (Eigen::Index k = 0; k < 3; ++k) {
        step += e.vectors.col(k) * (e.vectors.col(k).dot(right) / e.values[k]);
      }
      corner += step;
      if (step.squaredNorm() <= kRestSquared_m2) break;
    }
    keypoint.offset_m = (corner - start).cast<float>();
  }
}

Status HarrisDetector::detect(const Surface& surface, KeypointSet& keypoints) noexcept {
  keypoints.clear();
  last_ = {};
  const double radius =
      params_.radius_m > 0.0 ? params_.radius_m : params_.radius_ratio * surface.spacing_m;
  if (!(radius > 0.0)) return Error{Code::BadParameter, Stage::Keypoints, 0};
  if (const Status built = sums_.build(surface, radius); !built.ok()) {
    return Error{built.error().code, Stage::Keypoints, built.error().detail};
  }
  if (params_.engine == Engine::Fast) {
    respond_fast(surface);
  } else {
    respond_plainly(surface, radius);
  }
  last_ = response_.first(surface.size);
  const auto threshold = static_cast<float>(params_.threshold);
  const float reach = params_.suppress ? static_cast<float>(radius) : 0.0F;
  const std::span<Keypoint> found = maxima_.find(sums_.search(), last_, threshold, reach, 1);
  for (Keypoint& keypoint : found) keypoint.scale_m = static_cast<float>(radius);
  keep_strongest(found, keypoints);
  if (params_.suppress && params_.refine) refine(surface, radius, keypoints);
  return {};
}

}  // namespace grapnel
