#include "pipeline/object_reports.h"

#include <algorithm>

#include "base/insertion_sort.h"
#include "pipeline/shared_space.h"

namespace grapnel {
namespace {

// Poses are this wrong at the most, in diameters: deeper inside another part is a contradiction.
constexpr double kDepth = 0.03;
constexpr double kSigmas = 3.0;
constexpr double kMaxShared = 0.02;
// Nearer than this, in diameters, two poses of one model are the same part.
constexpr double kSamePose = 0.1;
constexpr double kSameTurn_rad = 0.2;

bool ranks_before(const RegistrationReport& a, const RegistrationReport& b) noexcept {
  if (a.accepted != b.accepted) return a.accepted;
  if (a.surface_grasp != b.surface_grasp) return a.surface_grasp;
  // The nearer to the camera lies on top.
  if (a.surface_grasp) {
    return a.target_from_grasp.translation().z() < b.target_from_grasp.translation().z();
  }
  // Rejected ones: by how much of the model was seen.
  return a.accepted
             ? a.quality > b.quality
             : a.fitness - 2.0 * a.free_space_violation > b.fitness - 2.0 * b.free_space_violation;
}

}  // namespace

void reject_for(const Reason& reason, RegistrationReport& report) noexcept {
  report.accepted = false;
  report.code = reason.code();
  report.quality = std::min(report.quality, 0.5);
  report.measured[reason.check] = static_cast<float>(reason.measured);
  // A full list keeps its first, as it would have without this one.
  if (!report.reasons.push_back(reason)) report.reasons[report.reasons.size() - 1] = reason;
  std::rotate(report.reasons.begin(), report.reasons.end() - 1, report.reasons.end());
}

void ObjectReports::keep(const RegistrationReport& report) noexcept {
  if (reports_.objects.push_back(report)) return;
  rank();
  RegistrationReport& last = reports_.objects[reports_.objects.size() - 1];
  if (ranks_before(report, last)) last = report;
}

void ObjectReports::keep_oversized(const ObjectGroup& piece, double size, double limit) noexcept {
  RegistrationReport report;
  report.pieces = piece.members;
  reject_for({Check::Size, size, limit}, report);
  report.quality = 0.0;
  keep(report);
}

void ObjectReports::rank() noexcept {
  insertion_sort(reports_.objects.begin(), reports_.objects.end(), ranks_before);
}

void ObjectReports::reject_shared_space(std::span<const ModelIndex> models,
                                        const DepthNoise& noise) noexcept {
  rank();
  RegistrationReport* const first = reports_.objects.begin();
  const auto is_accepted = [](const RegistrationReport& report) { return report.accepted; };
  RegistrationReport* const end = std::partition_point(first, reports_.objects.end(), is_accepted);
  for (RegistrationReport* a = first; a != end; ++a) {
    for (RegistrationReport* b = a + 1; b != end; ++b) {
      const ModelIndex& model_a = models[a->model];
      const ModelIndex& model_b = models[b->model];
      const double diameter_m = std::min(model_a.diameter_m, model_b.diameter_m);
      const auto z_m = static_cast<float>((a->target_from_source * model_a.centre).z());
      const double depth_m =
          std::max(kDepth * diameter_m, kSigmas * static_cast<double>(noise.sigma_m(z_m)));
      const double share =
          shared_space(model_a, a->target_from_source, model_b, b->target_from_source, depth_m);
      if (share <= kMaxShared) continue;
      const Reason reason{Check::SharedSpace, share, kMaxShared};
      reject_for(reason, *b);
      const bool twice = a->model == b->model &&
                         equivalent(b->target_from_source, a->target_from_source, model_a.symmetry,
                                    kSamePose * diameter_m, kSameTurn_rad);
      if (!twice) reject_for(reason, *a);
    }
  }
}

std::uint32_t ObjectReports::drop_covered() noexcept {
  std::uint32_t covered = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < reports_.objects.size(); ++i) {
    const RegistrationReport report = reports_.objects[i];
    if (!report.accepted && (report.pieces & covered) != 0) continue;
    covered |= report.pieces;
    reports_.objects[kept++] = report;
  }
  reports_.objects.resize(kept);
  return covered;
}

void ObjectReports::finish(const ObjectGroups& groups, std::size_t wanted) noexcept {
  rank();
  std::uint32_t covered = drop_covered();
  reports_.found = static_cast<std::uint32_t>(reports_.objects.size());
  const auto count = [&](const ObjectGroup& group) {
    if ((group.members & covered) != 0) return;
    covered |= group.members;
    ++reports_.found;
  };
  for (const ObjectGroup& group : groups.groups()) count(group);
  for (const ObjectGroup& group : groups.oversized()) count(group);
  if (reports_.objects.size() > wanted) reports_.objects.resize(wanted);
  reports_.code = Code::RoiEmpty;
  if (reports_.objects.empty()) return;
  reports_.code = reports_.objects[0].code;
  reports_.counts = reports_.objects[0].counts;
}

}  // namespace grapnel
