#include "pipeline/coarse/view_templates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/math.h"
#include "pipeline/coarse/hypothesis_list.h"

namespace grapnel {
namespace {

constexpr int kRaster = 64;
constexpr float kCosGrazing = 0.17F;

/// The i-th of n directions, evenly spread: a Fibonacci spiral on the sphere.
Vec3d direction(std::size_t i, std::size_t n) noexcept {
  constexpr double kGoldenAngle = 2.39996322972865332;
  const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(n);
  const double radius = std::sqrt(std::max(0.0, 1.0 - z * z));
  const double angle = kGoldenAngle * static_cast<double>(i);
  return {radius * math::cos(angle), radius * math::sin(angle), z};
}

/// Seen from far along `toward`: the visible points' middle and projected area.
ViewTemplate see(const Surface& model, const Vec3d& toward, std::vector<float>& raster) {
  const Mat3d axes = frame_about(toward);
  const Vec3f e1 = axes.col(1).cast<float>();
  const Vec3f e2 = axes.col(2).cast<float>();
  const Vec3f view = toward.cast<float>();
  float low_a = 1e30F;
  float low_b = 1e30F;
  float high = -1e30F;
  for (std::size_t i = 0; i < model.size; ++i) {
    const Vec3f p = model.point(i);
    low_a = std::min(low_a, e1.dot(p));
    low_b = std::min(low_b, e2.dot(p));
  }
  for (std::size_t i = 0; i < model.size; ++i) {
    const Vec3f p = model.point(i);
    high = std::max({high, e1.dot(p) - low_a, e2.dot(p) - low_b});
  }
  const float cell = std::max(high / (kRaster - 1), 1.5F * static_cast<float>(model.spacing_m));
  const auto place = [&](const Vec3f& p) {
    const int a = static_cast<int>((e1.dot(p) - low_a) / cell);
    const int b = static_cast<int>((e2.dot(p) - low_b) / cell);
    return static_cast<std::size_t>(b * kRaster + a);
  };
  std::fill(raster.begin(), raster.end(), -1e30F);
  for (std::size_t i = 0; i < model.size; ++i) {
    float& top = raster[place(model.point(i))];
    top = std::max(top, view.dot(model.point(i)));
  }
  ViewTemplate result;
  result.toward_camera = view;
  double weight = 0.0;
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < model.size; ++i) {
    const Vec3f p = model.point(i);
    const float cosine = model.normal(i).dot(view);
    // Within a cell a surface seen at this angle may rise by cell / tan.
    if (cosine < kCosGrazing || view.dot(p) < raster[place(p)] - 2.0F * cell / cosine) continue;
    weight += static_cast<double>(cosine);
    sum += static_cast<double>(cosine) * p.cast<double>();
  }
  if (weight > 0.0) result.middle = (sum / weight).cast<float>();
  result.visible_area_m2 = static_cast<float>(weight * model.spacing_m * model.spacing_m);
  return result;
}

}  // namespace

FieldTable view_template_fields() noexcept {
  using P = ViewTemplateParams;
  static constexpr std::array kFields = {
      number_field<&P::views>("views", "", 0, 2000, "directions a model is tried from; 0 = off"),
      number_field<&P::turns>("turns", "", 3, 360, "turns tried about each direction"),
      number_field<&P::slides>("slides", "", 0, 20,
                               "shifts toward the surface: for objects of which a part is missing"),
      number_field<&P::quick_samples>("quick_samples", "", 16, 4096, "samples of the first rating"),
      number_field<&P::finalists>("finalists", "", 1, 4096, "poses rated again with all samples"),
  };
  return kFields;
}

void ViewTemplates::reserve(Arena& arena, const ViewTemplateParams& params) {
  params_ = params;
  views_ = arena.take<ViewTemplate>(params.views);
  finalists_ = arena.take<Hypothesis>(params.finalists);
  rank_ = FixedList<std::uint16_t>(arena.take<std::uint16_t>(params.finalists));
  by_turn_ = arena.take<Hypothesis>(params.turns);
  turns_ = arena.take<Turn>(params.turns);
  turn_step_ = 2.0 * math::kPi / static_cast<double>(params.turns);
}

void ViewTemplates::build(const Surface& model, const ViewTemplateParams& params) {
  params_ = params;
  std::vector<float> raster(static_cast<std::size_t>(kRaster) * kRaster);
  for (std::size_t i = 0; i < views_.size(); ++i) {
    views_[i] = see(model, direction(i, views_.size()), raster);
  }
}

float ViewTemplates::least_area_m2() const noexcept {
  float least = 0.0F;
  for (const ViewTemplate& view : views_) {
    if (view.visible_area_m2 > 0.0F && (least == 0.0F || view.visible_area_m2 < least)) {
      least = view.visible_area_m2;
    }
  }
  return least;
}

float ViewTemplates::most_area_m2() const noexcept {
  float most = 0.0F;
  for (const ViewTemplate& view : views_) most = std::max(most, view.visible_area_m2);
  return most;
}

void ViewTemplates::set_out(const Vec3d& object_middle) noexcept {
  object_middle_ = object_middle;
  toward_camera_ = -object_middle.normalized();
  const Mat3d seen = frame_about(toward_camera_);
  for (std::size_t turn = 0; turn < turns_.size(); ++turn) {
    const double c = math::cos(turn_step_ * static_cast<double>(turn));
    const double s = math::sin(turn_step_ * static_cast<double>(turn));
    turns_[turn] = {c * seen.col(1) + s * seen.col(2), c * seen.col(2) - s * seen.col(1)};
  }
}

void ViewTemplates::place(const ViewTemplate& view) noexcept {
  const Vec3d model_axis = view.toward_camera.cast<double>();
  const Mat3d own = frame_about(model_axis);
  const Vec3d middle = view.middle.cast<double>();
  const Mat3d along = toward_camera_ * model_axis.transpose();
  for (std::size_t turn = 0; turn < turns_.size(); ++turn) {
    Pose& pose = by_turn_[turn].target_from_source;
    pose.setIdentity();
    pose.linear() = along + turns_[turn].first * own.col(1).transpose() +
                    turns_[turn].second * own.col(2).transpose();
    pose.translation() = object_middle_ - pose.linear() * middle;
  }
}

void ViewTemplates::keep_slid(Hypothesis hypothesis, const PoseScore& score) noexcept {
  const Hypothesis placed = hypothesis;
  for (std::size_t i = 0; i < params_.slides; ++i) {
    hypothesis.target_from_source =
        score.slid(hypothesis.target_from_source, params_.quick_samples);
  }
  if (params_.slides > 0) {
    hypothesis.support = score.glance(hypothesis.target_from_source, params_.quick_samples, -1e9);
  }
  const Hypothesis& better = hypothesis.support > placed.support ? hypothesis : placed;
  auto slot = static_cast<std::uint16_t>(rank_.size());
  if (full()) {
    slot = rank_[rank_.size() - 1];
    if (!(better.support > finalists_[slot].support)) return;
    rank_.resize(rank_.size() - 1);
  }
  finalists_[slot] = better;
  std::size_t place = rank_.size();
  rank_.resize(place + 1);
  for (; place > 0 && better.support > finalists_[rank_[place - 1]].support; --place) {
    rank_[place] = rank_[place - 1];
  }
  rank_[place] = slot;
}

void ViewTemplates::propose(const Vec3d& object_middle, const PoseScore& score,
                            Hypotheses& hypotheses) noexcept {
  set_out(object_middle);
  rank_.clear();
  const std::size_t turns = by_turn_.size();
  for (const ViewTemplate& view : views_) {
    if (!(view.visible_area_m2 > 0.0F)) continue;
    const double weakest =
        full() && params_.slides == 0 ? finalists_[rank_[rank_.size() - 1]].support : 0.0;
    place(view);
    for (std::size_t turn = 0; turn < turns; ++turn) {
      by_turn_[turn].support =
          score.glance(by_turn_[turn].target_from_source, params_.quick_samples, weakest);
    }
    // Of a hill of turns only its top: the list is for different poses.
    for (std::size_t turn = 0; turn < turns; ++turn) {
      const double before = by_turn_[(turn + turns - 1) % turns].support;
      const double after = by_turn_[(turn + 1) % turns].support;
      const double own = by_turn_[turn].support;
      if (own >= before && own > after) keep_slid(by_turn_[turn], score);
    }
  }
  for (const std::uint16_t slot : rank_) {
    Hypothesis& hypothesis = finalists_[slot];
    hypothesis.support = score(hypothesis.target_from_source, SIZE_MAX);
    keep_best(hypotheses, hypothesis);
  }
}

}  // namespace grapnel
