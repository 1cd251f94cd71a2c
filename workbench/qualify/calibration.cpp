#include "workbench/qualify/calibration.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "workbench/evaluate/statistics.h"

namespace grapnel {
namespace {

constexpr double kLeastRoom = 0.02;
constexpr double kLeastRoomRatio = 0.1;

/// How far a value lies on the good side of a limit.
double room(const LimitedCheck& check, double value, double limit) {
  return check.at_least ? value - limit : limit - value;
}

bool fails(const LimitedCheck& check, const CheckLimit& limit, double value) {
  return limit.set && !std::isnan(value) && room(check, value, limit.limit) < 0.0;
}

std::size_t failures(const Calibration& calibration, const LabelledPose& pose) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < kLimitedChecks.size(); ++i) {
    count += fails(kLimitedChecks[i], calibration.limits[i], pose.measured[i]) ? 1U : 0U;
  }
  return count;
}

double room_of_right(const LimitedCheck& check, const CheckLimit& limit) {
  const double least = check.at_least ? kLeastRoom : kLeastRoomRatio * std::fabs(limit.worst_right);
  return std::max(std::fabs(limit.median_right - limit.worst_right), least);
}

CheckLimit first_limit(const LimitedCheck& check, std::vector<double> values) {
  CheckLimit limit;
  if (values.empty()) return limit;
  limit.set = true;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  limit.worst_right = check.at_least ? *low : *high;
  limit.median_right = quantile(values, 0.5);
  const double far = room_of_right(check, limit);
  limit.limit = check.at_least ? std::max(0.0, limit.worst_right - far) : limit.worst_right + far;
  return limit;
}

/// Draws in the check that sets the pose the farthest apart from the right ones.
bool exclude(Calibration& calibration, const LabelledPose& pose) {
  std::size_t best = kLimitedChecks.size();
  double most = 0.0;
  for (std::size_t i = 0; i < kLimitedChecks.size(); ++i) {
    const CheckLimit& limit = calibration.limits[i];
    if (!limit.set || std::isnan(pose.measured[i])) continue;
    const double apart = -room(kLimitedChecks[i], pose.measured[i], limit.worst_right) /
                         std::max(room_of_right(kLimitedChecks[i], limit), 1e-12);
    if (apart > most) {
      most = apart;
      best = i;
    }
  }
  if (best == kLimitedChecks.size()) return false;
  CheckLimit& limit = calibration.limits[best];
  limit.limit = 0.5 * (limit.worst_right + pose.measured[best]);
  return true;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace

Calibration calibrate(std::span<const LabelledPose> poses) {
  Calibration calibration;
  for (const LabelledPose& pose : poses) ++(pose.right ? calibration.right : calibration.wrong);
  for (std::size_t i = 0; i < kLimitedChecks.size(); ++i) {
    std::vector<double> values;
    for (const LabelledPose& pose : poses) {
      if (pose.right && !std::isnan(pose.measured[i])) values.push_back(pose.measured[i]);
    }
    calibration.limits[i] = first_limit(kLimitedChecks[i], std::move(values));
  }
  for (const LabelledPose& pose : poses) {
    if (pose.right || failures(calibration, pose) > 0) continue;
    if (!exclude(calibration, pose)) calibration.inseparable.push_back(pose.id);
  }
  for (const LabelledPose& pose : poses) {
    if (pose.right) continue;
    const std::size_t count = failures(calibration, pose);
    for (std::size_t i = 0; i < kLimitedChecks.size(); ++i) {
      CheckLimit& limit = calibration.limits[i];
      if (!fails(kLimitedChecks[i], limit, pose.measured[i])) continue;
      ++limit.rejects;
      if (count == 1) ++limit.alone;
    }
  }
  return calibration;
}

std::string accept_table(const Calibration& calibration) {
  const std::size_t passed = calibration.inseparable.size();
  std::string text = "# From " + std::to_string(calibration.right) + " right and " +
                     std::to_string(calibration.wrong) + " wrong poses; " + std::to_string(passed) +
                     " wrong ones pass: at 95 % confidence at most " +
                     number(upper_bound_95(passed, calibration.wrong)) + " of such do.\n[accept]\n";
  for (std::size_t i = 0; i < kLimitedChecks.size(); ++i) {
    const CheckLimit& limit = calibration.limits[i];
    if (!limit.set) continue;
    text += std::string(kLimitedChecks[i].key) + " = " + number(limit.limit) +
            "  # right: median " + number(limit.median_right) + ", worst " +
            number(limit.worst_right) + "; rejects " + std::to_string(limit.rejects) + " wrong, " +
            std::to_string(limit.alone) + " alone\n";
  }
  return text;
}

}  // namespace grapnel
