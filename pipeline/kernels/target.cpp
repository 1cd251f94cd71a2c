#include "pipeline/kernels/target.h"

#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/target.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

std::int64_t CurrentTarget() { return HWY_TARGET; }

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(CurrentTarget);

namespace {

/// What the machine can do, whatever is forced.
std::int64_t machine_targets() noexcept {
  static const std::int64_t targets = hwy::SupportedTargets() & HWY_TARGETS;
  return targets;
}

}  // namespace

const char* target_name() noexcept {
  return hwy::TargetName(HWY_DYNAMIC_DISPATCH(CurrentTarget)());
}

std::vector<std::string> target_names() {
  std::vector<std::string> names;
  for (std::int64_t rest = machine_targets(); rest != 0; rest &= rest - 1) {
    names.emplace_back(hwy::TargetName(rest & ~(rest - 1)));
  }
  return names;
}

bool force_target(std::string_view name) noexcept {
  const std::int64_t all = machine_targets();
  std::int64_t chosen = name.empty() ? all : 0;
  for (std::int64_t rest = all; rest != 0 && chosen == 0; rest &= rest - 1) {
    const std::int64_t target = rest & ~(rest - 1);
    if (name == hwy::TargetName(target)) chosen = target;
  }
  if (chosen == 0) return false;
  hwy::GetChosenTarget().Update(chosen);
  return true;
}

}  // namespace grapnel::kernels
#endif
