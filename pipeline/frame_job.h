#pragma once

#include <cstdint>

#include "base/depth_frame.h"
#include "base/error.h"
#include "base/rng.h"
#include "pipeline/judge/verdict.h"
#include "pipeline/object_reports.h"
#include "pipeline/registrar_state.h"

namespace grapnel {

/// One job A on one frame: the pipeline's steps in their order. Lives as long as the job.
class FrameJob {
 public:
  FrameJob(RegistrarState& state, const JobContext& context) noexcept;

  Result<RegistrationReports> run(const DepthFrame& frame) noexcept;
  /// An organised surface, by way of the depth image that it came from.
  Result<RegistrationReports> run(const Surface& scene) noexcept;
  Result<double> occupied_share(const DepthFrame& frame) noexcept;

 private:
  Status prepare(const DepthFrame& frame) noexcept;
  Status find_objects(const DepthFrame& frame) noexcept;
  Status describe(const DepthFrame& frame, const ObjectGroup& group) noexcept;
  void view_component(const Component& component, std::uint8_t label) noexcept;
  Status register_models(bool& accepted) noexcept;
  Status register_model(std::size_t model_i, RegistrationReport& report) noexcept;
  void judge(std::size_t model_i, double floor_m, RegistrationReport& report) noexcept;
  void predict_deviation(std::size_t model_i, double floor_m, RegistrationReport& report) noexcept;
  void look_at_mirror(const ModelIndex& model, double floor_m, Findings& findings) noexcept;
  void look_at_ground(const ModelIndex& model, double floor_m, Findings& findings) noexcept;
  void look_for_grasp(RegistrationReport& report) const noexcept;
  void name_touching(std::size_t model_i, RegistrationReport& report) const noexcept;
  [[nodiscard]] std::size_t wanted_objects() const noexcept;
  void conclude() noexcept;
  [[nodiscard]] MeasuredObject measured() noexcept;

  RegistrarState& s_;
  const JobContext& context_;
  RegistrationReports reports_;
  ObjectReports objects_;
  JobWatch watch_;
  Rng rng_;
  DepthView view_;
  Vec3d middle_ = Vec3d::Zero();
  Ground ground_;
  SizeEstimate size_;
  double smallest_diameter_m_ = 0.0;
  double most_area_m2_ = 0.0;           ///< largest view of a model, projected
  std::uint32_t things_ = 0;            ///< bit i: component i is large enough to be a part
  const ObjectGroup* group_ = nullptr;  ///< what is looked at
  std::size_t accepted_ = 0;
};

}  // namespace grapnel
