#pragma once

#include <memory>
#include <vector>

#include "base/config.h"
#include "pipeline/judge/overlap.h"
#include "pipeline/judge/verdict.h"
#include "pipeline/model_index.h"
#include "pipeline/preprocess/background.h"
#include "pipeline/preprocess/decimate.h"
#include "pipeline/preprocess/depth_outliers.h"
#include "pipeline/preprocess/median.h"
#include "pipeline/preprocess/organize.h"
#include "pipeline/preprocess/segment.h"
#include "pipeline/refine/contour_fit.h"
#include "pipeline/search.h"
#include "pipeline/stage.h"
#include "pipeline/surface_grasp.h"

namespace grapnel {

/// What belongs to the pipeline as a whole.
struct GeneralParams {
  double spacing_m = 0.0;             ///< of working surfaces; 0 = auto: spacing_ratio
  double spacing_ratio = 0.022;       ///< × model diameter (pairs: of the smaller cloud)
  double sigma_1m_m = 0.001425;       ///< axial noise at 1 m, growing with z²
  double shared_error_px = 40.0;      ///< neighbouring readings that share one error
  double pose_error_px = 20.0;        ///< readings that count as one in a pose's covariance
  double common_error_px = 0.15;      ///< 1-sigma across the view that a part's outlines share
  double common_error_sigmas = 0.02;  ///< that its depths share, in sigmas of a reading
  std::size_t max_components = 6;     ///< objects looked at in vain in one frame, largest first
  double max_visible_ratio = 0.0;     ///< × the model's largest projected area: larger objects are
                                      ///< passed over; 0 = none
  double min_visible_ratio = 0.3;  ///< × the model's smallest projected area: smaller objects are
                                   ///< passed over
  bool measure_size = false;       ///< report what size an object has as a box or a barrel
};

/// Parameters of every fixed step, with their defaults.
struct StageParams {
  GeneralParams general;
  OrganizeParams organize;
  DepthOutlierParams outliers;
  DepthMedianParams median;
  BackgroundParams background;
  SegmentParams segment;
  DecimateParams decimate;
  ModelIndexParams model;
  ContourFitParams contour;
  SearchParams search;
  VerdictParams verdict;
  OverlapParams overlap;
  SurfaceGraspParams surface_grasp;
};

/// A table of a preset whose keys fill one parameter struct.
struct ParamTable {
  const char* name = nullptr;
  FieldTable fields;
  void* object = nullptr;  ///< inside the StageParams asked about
};
/// The fixed steps' tables, in the pipeline's order.
[[nodiscard]] std::vector<ParamTable> param_tables(StageParams& params);

/// The stages of one preset: the fixed steps and the methods chosen by name.
struct StageSet {
  explicit StageSet(const ConfigTable& preset);

  StageParams params;
  DepthOutliers outliers;
  DepthMedian median;
  BackgroundRemoval background;
  Segmenter segment;
  std::unique_ptr<NormalEstimator> normals;
  std::unique_ptr<KeypointDetector> keypoints;
  std::unique_ptr<DescriptorEstimator> descriptors;
  std::unique_ptr<FeatureMatcher> match;
  std::unique_ptr<CorrespondenceRejector> reject;  ///< every one of the preset, in its order
  std::unique_ptr<HypothesisGenerator> coarse;     ///< the same; supports_by_score()
  std::unique_ptr<PoseRefiner> refine_coarse;
  std::unique_ptr<PoseRefiner> refine;

 private:
  struct Taken;
  explicit StageSet(Taken taken);
};

}  // namespace grapnel
