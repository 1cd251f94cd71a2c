#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/judge/depth_view.h"
#include "pipeline/model_index.h"
#include "pipeline/object_groups.h"
#include "pipeline/report.h"

namespace grapnel {

/// Collects what was found in one frame: a report a thing, best first.
class ObjectReports {
 public:
  /// Fills `reports`, which outlives this.
  explicit ObjectReports(RegistrationReports& reports) noexcept : reports_(reports) {}

  /// A full list gives its weakest for a better one.
  void keep(const RegistrationReport& report) noexcept;
  /// Reports a piece larger than a part may be without a look: `size` in largest views of a part,
  /// of which `limit` is allowed.
  void keep_oversized(const ObjectGroup& piece, double size, double limit) noexcept;
  /// Two parts can't be in one place: of accepted ones that share space neither stays accepted,
  /// unless they are one pose found twice, of which the better one stays.
  void reject_shared_space(std::span<const ModelIndex> models, const DepthNoise& noise) noexcept;
  /// Ranks, leaves one report for each thing, counts what stands there, and keeps the best
  /// `wanted`.
  void finish(const ObjectGroups& groups, std::size_t wanted) noexcept;

 private:
  void rank() noexcept;
  /// Drops rejected reports of pieces that a better report is about. Returns all pieces reported.
  std::uint32_t drop_covered() noexcept;

  RegistrationReports& reports_;
};

/// Puts a failed check first: it names best why the report is rejected.
void reject_for(const Reason& reason, RegistrationReport& report) noexcept;

}  // namespace grapnel
