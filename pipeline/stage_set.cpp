#include "pipeline/stage_set.h"

#include <array>
#include <utility>

#include "pipeline/registry.h"

namespace grapnel {
namespace {

FieldTable general_fields() noexcept {
  using P = GeneralParams;
  static constexpr std::array kFields = {
      number_field<&P::spacing_m>("spacing_m", "m", 0.0, 10.0,
                                  "distance of points of working surfaces; 0 = by spacing_ratio"),
      number_field<&P::spacing_ratio>("spacing_ratio", "diameters", 0.001, 0.5,
                                      "distance of points of working surfaces"),
      number_field<&P::sigma_1m_m>("sigma_1m_m", "m", 0.0, 0.1,
                                   "axial noise at 1 m, 1 sigma; grows with z²"),
      number_field<&P::shared_error_px>("shared_error_px", "px", 1.0, 1000.0,
                                        "neighbouring readings that share one error"),
      number_field<&P::pose_error_px>("pose_error_px", "px", 1.0, 1000.0,
                                      "readings that count as one in a pose's covariance"),
      number_field<&P::common_error_px>("common_error_px", "px", 0.0, 100.0,
                                        "error across the view that all readings of a part share"),
      number_field<&P::common_error_sigmas>(
          "common_error_sigmas", "sigmas", 0.0, 100.0,
          "error along the view that all readings of a part share"),
      number_field<&P::max_components>("max_components", "", 1, 32,
                                       "objects looked at in one frame, largest first"),
      number_field<&P::max_visible_ratio>(
          "max_visible_ratio", "", 0.0, 1000.0,
          "objects larger than this times the model's largest view are passed over; 0 = none"),
      number_field<&P::min_visible_ratio>(
          "min_visible_ratio", "", 0.0, 1.0,
          "objects smaller than this share of the model's smallest view are passed over"),
  };
  return kFields;
}

}  // namespace

StageParams::StageParams() {
  refine_coarse.max_iterations = 7;
  refine_coarse.max_points = 300;
  refine_coarse.start_distance_ratio = 6.0;
  refine_coarse.end_distance_ratio = 2.5;
  refine_coarse.anneal_iterations = 5;
  refine_coarse.max_normal_angle_rad = 1.1;
  refine.max_iterations = 10;
  refine.max_points = 800;
  refine.start_distance_ratio = 2.5;
  refine.end_distance_ratio = 1.0;
  refine.anneal_iterations = 5;
  refine.convergence_m = 1e-4;
  refine.convergence_rad = 2e-4;
}

std::vector<ParamTable> param_tables(StageParams& p) {
  return {
      {"general", general_fields(), &p.general},
      {"organize", organize_fields(), &p.organize},
      {"outliers", depth_outlier_fields(), &p.outliers},
      {"median", depth_median_fields(), &p.median},
      {"background", background_fields(), &p.background},
      {"segment", segment_fields(), &p.segment},
      {"decimate", decimate_fields(), &p.decimate},
      {"model", model_index_fields(), &p.model},
      {"views", view_template_fields(), &p.model.templates},
      {"coarse", ransac_fields(), &p.coarse},
      {"refine_coarse", icp_fields(), &p.refine_coarse},
      {"refine", icp_fields(), &p.refine},
      {"contour", contour_fit_fields(), &p.contour},
      {"search", search_fields(), &p.search},
      {"accept", verdict_fields(), &p.verdict},
      {"accept_pair", overlap_fields(), &p.overlap},
  };
}

std::vector<std::string> method_tables() {
  return {"normals", "keypoints", "descriptors", "match", "reject"};
}

struct StageSet::Taken {
  StageParams params;
  std::unique_ptr<NormalEstimator> normals;
  std::unique_ptr<KeypointDetector> keypoints;
  std::unique_ptr<DescriptorEstimator> descriptors;
  std::unique_ptr<FeatureMatcher> match;
  std::unique_ptr<CorrespondenceRejector> reject;

  explicit Taken(const ConfigTable& preset) {
    ConfigReader reader(preset);
    for (const ParamTable& table : param_tables(params)) {
      const ConfigTable* found = reader.take_table(table.name);
      if (found == nullptr) continue;
      ConfigReader entry(*found);
      entry.take_fields(table.fields, table.object);
      entry.finish();
    }
    take(reader, "normals", normal_estimators(), "pca", normals);
    take(reader, "keypoints", keypoint_detectors(), "iss", keypoints);
    take(reader, "descriptors", descriptor_estimators(), "fpfh", descriptors);
    take(reader, "match", feature_matchers(), "nearest_feature", match);
    take(reader, "reject", correspondence_rejectors(), "median", reject);
  }

  template <class StageKind>
  static void take(ConfigReader& reader, const char* name,
                   std::span<const Method<StageKind>> methods, std::string_view fallback,
                   std::unique_ptr<StageKind>& stage) {
    const ConfigTable empty("", name, 0);
    const ConfigTable* found = reader.take_table(name);
    ConfigReader entry(found == nullptr ? empty : *found);
    stage = make_method(methods, entry, fallback);
    entry.finish();
  }
};

StageSet::StageSet(const ConfigTable& preset) : StageSet(Taken(preset)) {}

StageSet::StageSet(Taken taken)
    : params(taken.params),
      outliers(params.outliers),
      median(params.median),
      background(params.background),
      segment(params.segment),
      normals(std::move(taken.normals)),
      keypoints(std::move(taken.keypoints)),
      descriptors(std::move(taken.descriptors)),
      match(std::move(taken.match)),
      reject(std::move(taken.reject)) {}

}  // namespace grapnel
