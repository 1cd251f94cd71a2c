#include "pipeline/stage_set.h"

#include <array>
#include <utility>

#include "pipeline/coarse/generator_chain.h"
#include "pipeline/method_slots.h"
#include "pipeline/reject/rejector_chain.h"

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
      number_field<&P::pose_error_px>(
          "pose_error_px", "px", 1.0, 1000.0,
          "readings that count as one in the covariance of a pair's pose"),
      number_field<&P::common_error_px>("common_error_px", "px", 0.0, 100.0,
                                        "error across the view that all outlines of a part share"),
      number_field<&P::common_error_sigmas>("common_error_sigmas", "sigmas", 0.0, 100.0,
                                            "error along the view that all depths of a part share"),
      number_field<&P::max_components>(
          "max_components", "", 1, 32,
          "objects looked at in vain, largest first, before the search ends"),
      number_field<&P::max_visible_ratio>(
          "max_visible_ratio", "", 0.0, 1000.0,
          "objects larger than this times the model's largest view are passed over; 0 = none"),
      number_field<&P::min_visible_ratio>(
          "min_visible_ratio", "", 0.0, 1.0,
          "objects smaller than this share of the model's smallest view are passed over"),
      bool_field<&P::measure_size>("measure_size",
                                   "report an object's own size as a box or a barrel"),
  };
  return kFields;
}

}  // namespace

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
      {"contour", contour_fit_fields(), &p.contour},
      {"search", search_fields(), &p.search},
      {"accept", verdict_fields(), &p.verdict},
      {"accept_pair", overlap_fields(), &p.overlap},
      {"surface_grasp", surface_grasp_fields(), &p.surface_grasp},
  };
}

struct StageSet::Taken {
  StageParams params;
  std::unique_ptr<NormalEstimator> normals;
  std::unique_ptr<KeypointDetector> keypoints;
  std::unique_ptr<DescriptorEstimator> descriptors;
  std::unique_ptr<FeatureMatcher> match;
  std::unique_ptr<CorrespondenceRejector> reject;
  std::unique_ptr<HypothesisGenerator> coarse;
  std::unique_ptr<PoseRefiner> refine_coarse;
  std::unique_ptr<PoseRefiner> refine;

  explicit Taken(const ConfigTable& preset) {
    ConfigReader reader(preset);
    for (const ParamTable& table : param_tables(params)) {
      const ConfigTable* found = reader.take_table(table.name);
      if (found == nullptr) continue;
      ConfigReader entry(*found);
      entry.take_fields(table.fields, table.object);
      entry.finish();
    }
    const MethodSlots slots = method_slots();
    normals = one(reader, slots.normals);
    keypoints = one(reader, slots.keypoints);
    descriptors = one(reader, slots.descriptors);
    match = one(reader, slots.match);
    reject = std::make_unique<RejectorChain>(make_stages(slots.reject, reader));
    coarse =
        std::make_unique<GeneratorChain>(make_stages(slots.coarse, reader), params.search.kept);
    refine_coarse = one(reader, slots.refine_coarse);
    refine = one(reader, slots.refine);
  }

  template <class StageKind>
  static std::unique_ptr<StageKind> one(ConfigReader& reader, const MethodSlot<StageKind>& slot) {
    return std::move(make_stages(slot, reader).front());
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
      reject(std::move(taken.reject)),
      coarse(std::move(taken.coarse)),
      refine_coarse(std::move(taken.refine_coarse)),
      refine(std::move(taken.refine)) {}

}  // namespace grapnel
