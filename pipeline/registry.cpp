#include "pipeline/registry.h"

#include <array>

#include "pipeline/coarse/cylinder_axes.h"
#include "pipeline/coarse/generators.h"
#include "pipeline/coarse/pair_voting.h"
#include "pipeline/coarse/plane_frames.h"
#include "pipeline/coarse/resting_poses.h"
#include "pipeline/coarse/surface_ransac.h"
#include "pipeline/correspond/nearest_feature.h"
#include "pipeline/descriptors/fpfh.h"
#include "pipeline/descriptors/pfh.h"
#include "pipeline/descriptors/spin_image.h"
#include "pipeline/keypoints/curvature.h"
#include "pipeline/keypoints/harris3d.h"
#include "pipeline/keypoints/iss.h"
#include "pipeline/keypoints/narf.h"
#include "pipeline/keypoints/sift3d.h"
#include "pipeline/keypoints/uniform.h"
#include "pipeline/preprocess/border_points.h"
#include "pipeline/preprocess/clusters.h"
#include "pipeline/preprocess/covariance_sampling.h"
#include "pipeline/preprocess/crop.h"
#include "pipeline/preprocess/flying_points.h"
#include "pipeline/preprocess/grid_stride.h"
#include "pipeline/preprocess/integral_normals.h"
#include "pipeline/preprocess/normal_space.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/plane_normals.h"
#include "pipeline/preprocess/radius_outliers.h"
#include "pipeline/preprocess/random_sample.h"
#include "pipeline/preprocess/statistical_outliers.h"
#include "pipeline/preprocess/uniform_sample.h"
#include "pipeline/preprocess/voxel.h"
#include "pipeline/preprocess/voxel_covariance.h"
#include "pipeline/preprocess/z_median.h"
#include "pipeline/refine/generalized_icp.h"
#include "pipeline/refine/icp.h"
#include "pipeline/refine/plain_icp.h"
#include "pipeline/reject/distance.h"
#include "pipeline/reject/graph.h"
#include "pipeline/reject/median.h"
#include "pipeline/reject/one_to_one.h"
#include "pipeline/reject/ransac.h"
#include "pipeline/reject/surface_normal.h"
#include "pipeline/reject/trimmed.h"

namespace grapnel {
namespace {

template <class StageKind, class Stage, class Params, FieldTable (*kFields)() noexcept>
constexpr Method<StageKind> method(std::string_view name) {
  return {name, kFields,
          [](ConfigReader& reader) -> std::unique_ptr<StageKind> {
            Params params;
            reader.take_fields(kFields(), &params);
            return std::make_unique<Stage>(params);
          },
          [](std::size_t field, const ConfigTable& over) {
            Params params;
            ConfigReader(over).take_fields(kFields(), &params);
            return field_value_text(kFields()[field], &params);
          }};
}

constexpr std::array kFilters = {
    method<CloudFilter, VoxelGrid, VoxelParams, voxel_fields>("voxel"),
    method<CloudFilter, StatisticalOutliers, StatisticalOutlierParams, statistical_outlier_fields>(
        "statistical_outliers"),
    method<CloudFilter, RadiusOutliers, RadiusOutlierParams, radius_outlier_fields>(
        "radius_outliers"),
    method<CloudFilter, FlyingPoints, FlyingPointParams, flying_point_fields>("flying_points"),
    method<CloudFilter, ZMedian, ZMedianParams, z_median_fields>("z_median"),
    method<CloudFilter, GridStride, GridStrideParams, grid_stride_fields>("grid_stride"),
    method<CloudFilter, UniformSample, UniformSampleParams, uniform_sample_fields>(
        "uniform_sample"),
    method<CloudFilter, RandomSample, RandomSampleParams, random_sample_fields>("random_sample"),
    method<CloudFilter, NormalSpaceSample, NormalSpaceParams, normal_space_fields>("normal_space"),
    method<CloudFilter, CovarianceSampling, CovarianceSamplingParams, covariance_sampling_fields>(
        "covariance_sampling"),
    method<CloudFilter, VoxelCovariance, VoxelCovarianceParams, voxel_covariance_fields>(
        "voxel_covariance"),
    method<CloudFilter, BorderPoints, BorderPointsParams, border_points_fields>("border_points"),
    method<CloudFilter, Crop, CropParams, crop_fields>("crop"),
    method<CloudFilter, Clusters, ClusterParams, cluster_fields>("clusters"),
};
constexpr std::array kNormals = {
    method<NormalEstimator, PcaNormals, PcaNormalsParams, pca_normals_fields>("pca"),
    method<NormalEstimator, PlaneNormals, PlaneNormalsParams, plane_normals_fields>("grid_plane"),
    method<NormalEstimator, IntegralNormals, IntegralNormalsParams, integral_normals_fields>(
        "integral_image"),
};
constexpr std::array kDetectors = {
    method<KeypointDetector, IssDetector, IssParams, iss_fields>("iss"),
    method<KeypointDetector, HarrisDetector, HarrisParams, harris_fields>("harris3d"),
    method<KeypointDetector, SiftDetector, SiftParams, sift_fields>("sift3d"),
    method<KeypointDetector, NarfDetector, NarfParams, narf_fields>("narf"),
    method<KeypointDetector, CurvatureDetector, CurvatureKeypointParams, curvature_keypoint_fields>(
        "principal_curvature"),
    method<KeypointDetector, UniformDetector, UniformParams, uniform_fields>("uniform"),
};
constexpr std::array kDescriptors = {
    method<DescriptorEstimator, FpfhEstimator, FpfhParams, fpfh_fields>("fpfh"),
    method<DescriptorEstimator, PfhEstimator, PfhParams, pfh_fields>("pfh"),
    method<DescriptorEstimator, SpinImageEstimator, SpinImageParams, spin_image_fields>(
        "spin_image"),
};
constexpr std::array kMatchers = {
    method<FeatureMatcher, NearestFeature, NearestFeatureParams, nearest_feature_fields>(
        "nearest_feature"),
};
constexpr std::array kRejectors = {
    method<CorrespondenceRejector, MedianRejector, MedianRejectorParams, median_rejector_fields>(
        "median"),
    method<CorrespondenceRejector, RansacRejector, RansacRejectorParams, ransac_rejector_fields>(
        "ransac"),
    method<CorrespondenceRejector, DistanceRejector, DistanceRejectorParams,
           distance_rejector_fields>("distance"),
    method<CorrespondenceRejector, OneToOneRejector, OneToOneRejectorParams,
           one_to_one_rejector_fields>("one_to_one"),
    method<CorrespondenceRejector, TrimmedRejector, TrimmedRejectorParams, trimmed_rejector_fields>(
        "trimmed"),
    method<CorrespondenceRejector, SurfaceNormalRejector, SurfaceNormalRejectorParams,
           surface_normal_rejector_fields>("surface_normal"),
    method<CorrespondenceRejector, GraphRejector, GraphRejectorParams, graph_rejector_fields>(
        "graph"),
};

constexpr std::array kGenerators = {
    method<HypothesisGenerator, SurfaceRansac, SurfaceRansacParams, surface_ransac_fields>(
        "surface_ransac"),
    method<HypothesisGenerator, SvdGenerator, SvdParams, svd_fields>("svd"),
    method<HypothesisGenerator, RansacGenerator, RansacGeneratorParams, ransac_generator_fields>(
        "ransac"),
    method<HypothesisGenerator, SampleConsensus, SampleConsensusParams, sample_consensus_fields>(
        "sample_consensus"),
    method<HypothesisGenerator, PlaneFrames, PlaneFramesParams, plane_frames_fields>(
        "plane_frames"),
    method<HypothesisGenerator, CylinderAxes, CylinderAxesParams, cylinder_axes_fields>(
        "cylinder_axes"),
    method<HypothesisGenerator, RestingPoses, RestingPosesParams, resting_poses_fields>(
        "resting_poses"),
    method<HypothesisGenerator, PairVoting, PairVotingParams, pair_voting_fields>("pair_voting"),
};
constexpr std::array kRefiners = {
    method<PoseRefiner, Icp, IcpParams, icp_fields>("icp"),
    method<PoseRefiner, GeneralizedIcp, GeneralizedIcpParams, generalized_icp_fields>(
        "generalized_icp"),
    method<PoseRefiner, PlainIcp, PlainIcpParams, plain_icp_fields>("plain_icp"),
};

}  // namespace

std::span<const Method<CloudFilter>> cloud_filters() noexcept { return kFilters; }
std::span<const Method<NormalEstimator>> normal_estimators() noexcept { return kNormals; }
std::span<const Method<KeypointDetector>> keypoint_detectors() noexcept { return kDetectors; }
std::span<const Method<DescriptorEstimator>> descriptor_estimators() noexcept {
  return kDescriptors;
}
std::span<const Method<FeatureMatcher>> feature_matchers() noexcept { return kMatchers; }
std::span<const Method<CorrespondenceRejector>> correspondence_rejectors() noexcept {
  return kRejectors;
}
std::span<const Method<HypothesisGenerator>> hypothesis_generators() noexcept {
  return kGenerators;
}
std::span<const Method<PoseRefiner>> pose_refiners() noexcept { return kRefiners; }

}  // namespace grapnel
