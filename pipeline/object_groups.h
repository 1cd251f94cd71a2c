#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/fixed_list.h"
#include "pipeline/limits.h"
#include "pipeline/preprocess/segment.h"
#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

/// One thing to look for models in: a connected piece of foreground, or several that lie side by
/// side in the image and together are no larger than the model (a part that hides some of itself
/// falls apart at its own depth edges).
struct ObjectGroup {
  Component whole;
  std::uint32_t members = 0;  ///< bit i = component i
  std::uint8_t label = 0;  ///< of its pixels once select() was called: that of its largest member
};

/// Groups first, then the pieces they were made of.
class ObjectGroups {
 public:
  static constexpr std::size_t kMaxGroups = 2 * kMaxComponents;

  void reserve(Arena& arena, const Limits& limits);
  /// Sizes an object may have: `diameter_m` is the largest model's; projected areas, of which
  /// smaller pieces are only looked at as members of a group.
  struct Bounds {
    double diameter_m = 0.0;
    double min_area_m2 = 0.0;
    double max_area_m2 = 0.0;
  };
  /// O(pixels).
  void find(const WorkingDepth& work, const Components& components, const Bounds& bounds) noexcept;
  [[nodiscard]] const InlineList<ObjectGroup, kMaxGroups>& groups() const noexcept {
    return groups_;
  }
  /// Pieces larger than an object may be: several that touch, or something else.
  [[nodiscard]] const InlineList<ObjectGroup, kMaxComponents>& oversized() const noexcept {
    return oversized_;
  }
  /// Gives all pixels of a group the same label, and every other pixel its own back.
  void select(const ObjectGroup& group, WorkingDepth& work) noexcept;

 private:
  void find_neighbours(const WorkingDepth& work, const Components& components, int gap_px) noexcept;
  [[nodiscard]] ObjectGroup join(const Components& components, std::uint32_t members,
                                 const WorkingDepth& work) const noexcept;
  [[nodiscard]] double radius_m(const WorkingDepth& work, const ObjectGroup& group) const noexcept;

  std::span<std::uint8_t> own_label_;  // as the segmenter left them
  std::uint32_t beside_[kMaxComponents] = {};
  InlineList<ObjectGroup, kMaxGroups> groups_;
  InlineList<ObjectGroup, kMaxComponents> oversized_;
};

}  // namespace grapnel
