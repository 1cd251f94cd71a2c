#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/arena.h"
#include "pipeline/coarse/pose_score.h"
#include "pipeline/features.h"
#include "pipeline/judge/covariance.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/model_index.h"
#include "pipeline/object_groups.h"
#include "pipeline/pair_state.h"
#include "pipeline/preprocess/segment.h"
#include "pipeline/preprocess/working_depth.h"
#include "pipeline/registrar.h"
#include "pipeline/search.h"
#include "pipeline/size_estimator.h"
#include "pipeline/stage_set.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Times the stages of a job and says when it must stop. Reads the clock at stage boundaries only.
class JobWatch {
 public:
  JobWatch(const JobContext& context, RegistrationReports& reports) noexcept;

  /// Ends the stage before, begins this one. Errors: JobDeadline, Aborted.
  [[nodiscard]] Status enter(Stage stage) noexcept;
  /// Ends the last stage and sets total_us.
  void finish() noexcept;

 private:
  void charge() noexcept;

  const JobContext& context_;
  RegistrationReports& reports_;
  Stage stage_ = Stage::None;
  std::int64_t begin_us_ = 0;
  std::int64_t since_us_ = 0;
};

/// A measured cloud ready for matching: thinned, with normals and features.
struct DescribedSurface {
  Surface surface;
  SampleSet samples;
  KeypointSet keypoints;
  FeatureMatrix features;

  void reserve(Arena& arena, const Limits& limits, std::size_t grid_pixels, std::size_t dimension,
               std::size_t max_samples);
};

/// Everything a registrar owns, carved from one arena.
struct RegistrarState {
  explicit RegistrarState(Preset preset_);
  /// Runs over a measuring and a carving arena; `parts` (may be null) gets the sum by part.
  void reserve(Arena& arena, std::vector<MemoryItem>* parts);
  /// Load time: indexes and describes the models.
  void build_models();
  /// Normals at the radius of measured surfaces; with `keep_side` the side that the surface's own
  /// normals point to is kept. Allocates nothing.
  Status renew_normals(Surface& surface, bool keep_side) noexcept;

  Preset preset;
  StageSet stages;
  double spacing_m = 0.0;  ///< of working surfaces, from the models; 0 for pairs

  // Frames
  WorkingDepth work;
  std::span<std::uint16_t> depth_of_cloud;  ///< an organised cloud as a depth image
  Components components;
  ObjectGroups groups;
  RowBands foreground;  ///< where something may stand above the background
  BackgroundReport background;
  ThinnedDepth thinned;
  EdgeMap edges;
  DescribedSurface object;
  Correspondences correspondences;
  ObjectSearch search;
  SizeEstimator sizes;
  std::vector<ModelIndex> models;
  std::vector<RequiredDirections> required;
  std::span<float> own_nx, own_ny, own_nz;  ///< scratch of renew_normals()
  PairState pair;                           ///< carved for presets without models
  std::vector<Pose> grasp;                  ///< model_from_frame whose uncertainty is judged

  struct FreeBlock {
    void operator()(std::byte* block) const noexcept;
  };
  std::unique_ptr<std::byte[], FreeBlock> own_memory;
  std::size_t used_bytes = 0;
};

}  // namespace grapnel
