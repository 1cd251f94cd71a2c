#include "tests/example/sack_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace grapnel::example {
namespace {

constexpr Rgb8 kRight = {60, 220, 90};
constexpr Rgb8 kWrong = {240, 70, 60};
constexpr Rgb8 kSource = {235, 140, 40};
constexpr Rgb8 kTarget = {70, 130, 220};
constexpr int kMargin_px = 12;
constexpr int kShown_px = 250;  // width of a cut-out

constexpr Rgb8 kPaper = {255, 255, 255};
constexpr int kGap_px = 8;

void put(RgbImage& image, int u, int v, const Rgb8& color) {
  if (image.contains(u, v)) image.at(u, v) = color;
}

void dot(RgbImage& image, double u, double v, const Rgb8& color) {
  constexpr int kRadius_px = 2;
  for (int dv = -kRadius_px; dv <= kRadius_px; ++dv) {
    for (int du = -kRadius_px; du <= kRadius_px; ++du) {
      if (du * du + dv * dv > kRadius_px * kRadius_px + 1) continue;
      put(image, static_cast<int>(u) + du, static_cast<int>(v) + dv, color);
    }
  }
}

void line(RgbImage& image, double u0, double v0, double u1, double v1, const Rgb8& color) {
  const int steps = 1 + static_cast<int>(std::max(std::fabs(u1 - u0), std::fabs(v1 - v0)));
  for (int i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    put(image, static_cast<int>(u0 + t * (u1 - u0)), static_cast<int>(v0 + t * (v1 - v0)), color);
  }
}

/// A rectangle of the image around the sack, shown at kShown_px columns.
struct Cut {
  int left = std::numeric_limits<int>::max();
  int top = std::numeric_limits<int>::max();
  int right = 0;
  int bottom = 0;

  explicit Cut(const SackView& view) {
    for (int v = 0; v < view.frame.depth.height; ++v) {
      for (int u = 0; u < view.frame.depth.width; ++u) {
        if (view.frame.depth.at(u, v) == 0) continue;
        left = std::min(left, u);
        top = std::min(top, v);
        right = std::max(right, u);
        bottom = std::max(bottom, v);
      }
    }
    left = std::max(0, left - kMargin_px);
    top = std::max(0, top - kMargin_px);
    right = std::min(view.frame.depth.width - 1, right + kMargin_px);
    bottom = std::min(view.frame.depth.height - 1, bottom + kMargin_px);
  }
  [[nodiscard]] double scale() const { return static_cast<double>(kShown_px) / (right - left + 1); }
  [[nodiscard]] int rows() const { return static_cast<int>((bottom - top + 1) * scale()); }
};

/// `light` 1: as taken; less is darker and greyer.
RgbImage cut_out(const SackView& view, const Cut& cut, int rows, double light) {
  RgbImage picture(kShown_px, rows, kPaper);
  for (int v = 0; v < picture.height(); ++v) {
    for (int u = 0; u < picture.width(); ++u) {
      const int column = cut.left + static_cast<int>(u / cut.scale());
      const int row = cut.top + static_cast<int>(v / cut.scale());
      if (column >= view.frame.color.width || row >= view.frame.color.height) continue;
      Rgb8 color = view.frame.color.at(column, row);
      if (light < 1.0) {
        const double grey = light * (color.r + color.g + color.b) / 3.0;
        color.r = color.g = color.b = static_cast<std::uint8_t>(grey);
      }
      picture.at(u, v) = color;
    }
  }
  return picture;
}

struct Place {
  double u = 0.0;
  double v = 0.0;
};
Place shown_at(const Surface& surface, const Keypoint& keypoint, const SackView& view,
               const Cut& cut) {
  const Vec3f p = surface.point(static_cast<std::size_t>(keypoint.point)) + keypoint.offset_m;
  const Intrinsics& k = view.frame.intrinsics;
  const double u = k.fx * static_cast<double>(p.x() / p.z()) + k.cx;
  const double v = k.fy * static_cast<double>(p.y() / p.z()) + k.cy;
  return {(u - cut.left) * cut.scale(), (v - cut.top) * cut.scale()};
}

/// Draws the nearest of the points that fall on a pixel, seen from the sack's side.
class SideView {
 public:
  explicit SideView(const Vec3d& middle)
      : middle_(middle),
        picture_(2 * kShown_px, kShown_px, kPaper),
        near_(static_cast<std::size_t>(2 * kShown_px * kShown_px), 1e9) {
    turned_ = rotation_from_vector({-1.15, 0.0, 0.0});
  }
  void draw(const Surface& surface, const Pose& pose, const Rgb8& color) {
    for (std::size_t i = 0; i < surface.size; ++i) {
      const Vec3d p = turned_ * (pose * surface.point(i).cast<double>() - middle_);
      const int u = static_cast<int>(picture_.width() / 2 + kPixelsPerM * p.x());
      const int v = static_cast<int>(picture_.height() / 2 + kPixelsPerM * p.y());
      if (!picture_.contains(u, v)) continue;
      double& nearest = near_[static_cast<std::size_t>(v * picture_.width() + u)];
      if (p.z() >= nearest) continue;
      nearest = p.z();
      picture_.at(u, v) = color;
    }
  }
  [[nodiscard]] const RgbImage& picture() const { return picture_; }

 private:
  static constexpr double kPixelsPerM = 800.0;
  Vec3d middle_;
  Mat3d turned_;
  RgbImage picture_;
  std::vector<double> near_;
};

}  // namespace

namespace {

/// Both views' cut-outs beside each other.
struct TwoCuts {
  Cut source;
  Cut target;
  int rows;
  explicit TwoCuts(const SackPair& pair)
      : source(pair.source), target(pair.target), rows(std::max(source.rows(), target.rows())) {}
  [[nodiscard]] RgbImage draw(const SackPair& pair, double light) const {
    const std::array<RgbImage, 2> both = {cut_out(pair.source, source, rows, light),
                                          cut_out(pair.target, target, rows, light)};
    return side_by_side(both, kGap_px);
  }
};

}  // namespace

RgbImage draw_views(const SackPair& pair) { return TwoCuts(pair).draw(pair, 1.0); }

RgbImage draw_keypoints(const SackPair& pair, const Steps& steps) {
  const Cut cut(pair.source);
  RgbImage picture = cut_out(pair.source, cut, cut.rows(), 0.6);
  const std::vector<bool> again = found_again(steps, pair);
  for (std::size_t i = 0; i < again.size(); ++i) {
    const Place at = shown_at(steps.source->surface, steps.source_keypoints[i], pair.source, cut);
    dot(picture, at.u, at.v, again[i] ? kRight : kWrong);
  }
  return picture;
}

RgbImage draw_matches(const SackPair& pair, const Steps& steps,
                      const std::vector<Correspondence>& matches) {
  const TwoCuts cuts(pair);
  RgbImage both = cuts.draw(pair, 0.6);
  const int shift = kShown_px + kGap_px;
  // The right ones last, on top.
  for (const bool right : {false, true}) {
    for (const Correspondence& match : matches) {
      if (is_right(match, steps, pair) != right) continue;
      const Place s = shown_at(steps.source->surface,
                               steps.source_keypoints[static_cast<std::size_t>(match.source)],
                               pair.source, cuts.source);
      const Place t = shown_at(steps.target->surface,
                               steps.target_keypoints[static_cast<std::size_t>(match.target)],
                               pair.target, cuts.target);
      line(both, s.u, s.v, shift + t.u, t.v, right ? kRight : kWrong);
    }
  }
  return both;
}

RgbImage draw_merged(const SackPair& pair, const Pose& target_from_source) {
  SideView view(pair.target_from_source * pair.middle);
  view.draw(pair.target.surface->surface, Pose::Identity(), kTarget);
  view.draw(pair.source.surface->surface, target_from_source, kSource);
  return view.picture();
}

}  // namespace grapnel::example
