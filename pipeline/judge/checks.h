#pragma once

#include <algorithm>
#include <cmath>

#include "pipeline/report.h"

namespace grapnel {

/// Collects the failing checks of a verdict; the quality is the tightest check's room.
class Checks {
 public:
  /// Empties the report's reasons.
  explicit Checks(RegistrationReport& report) noexcept : report_(report) {
    report.reasons.clear();
    report.measured = {};
  }

  /// `perfect` is where a measured value has all the room there is.
  void at_least(Check check, double measured, double limit, double perfect) noexcept {
    record(check, measured);
    if (!(measured >= limit)) report_.reasons.push_back({check, measured, limit});
    note((measured - limit) / std::max(perfect - limit, 1e-9));
  }
  /// 0 is perfect.
  void at_most(Check check, double measured, double limit) noexcept {
    record(check, measured);
    if (!(measured <= limit)) report_.reasons.push_back({check, measured, limit});
    note((limit - measured) / std::max(limit, 1e-9));
  }
  /// For the report alone.
  void record(Check check, double measured) noexcept {
    report_.measured[check] = static_cast<float>(measured);
  }
  /// Writes verdict, code and quality: 0.5 on the limit of some check, 1 when all are perfect.
  void conclude() noexcept {
    report_.quality = std::clamp(0.5 + 0.5 * room_, 0.0, 1.0);
    report_.accepted = report_.reasons.empty();
    report_.code = report_.accepted ? Code::ObjectFound : report_.reasons[0].code();
  }

 private:
  void note(double room) noexcept { room_ = std::min(room_, std::isfinite(room) ? room : -1.0); }

  RegistrationReport& report_;
  double room_ = 1.0;
};

}  // namespace grapnel
