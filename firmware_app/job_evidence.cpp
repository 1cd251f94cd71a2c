#include "firmware_app/job_evidence.h"

#include <algorithm>

namespace grapnel {
namespace {

/// Copies the rows and views the copy; empty when it does not fit.
template <class Pixel>
ImageView<const Pixel> copy_image(ImageView<const Pixel> from, std::span<Pixel> to) noexcept {
  if (from.empty() || from.pixels() > to.size()) return {};
  Pixel* out = to.data();
  for (int v = 0; v < from.height; ++v) {
    out = std::copy_n(from.row(v), from.width, out);
  }
  return {to.data(), from.width, from.height};
}

}  // namespace

void EvidenceSlot::reserve(Arena& arena, int max_width, int max_height, bool with_color) {
  const std::size_t pixels =
      static_cast<std::size_t>(max_width) * static_cast<std::size_t>(max_height);
  depth_ = arena.take<std::uint16_t>(pixels);
  background_ = arena.take<std::uint16_t>(pixels);
  if (with_color) color_ = arena.take<Rgb8>(pixels);
}

bool EvidenceSlot::put(const JobEvidence& evidence) noexcept {
  if (full_.load(std::memory_order_acquire)) return false;
  evidence_ = evidence;
  evidence_.frame.depth = copy_image(evidence.frame.depth, depth_);
  evidence_.frame.color = copy_image(evidence.frame.color, color_);
  evidence_.context.background.depth = copy_image(evidence.context.background.depth, background_);
  evidence_.context.clock = nullptr;
  evidence_.context.abort = nullptr;
  evidence_.context.deadline_us = 0;
  full_.store(true, std::memory_order_release);
  arrived_.notify();
  return true;
}

}  // namespace grapnel
