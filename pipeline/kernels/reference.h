#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/kernels/best_rows.h"
#include "pipeline/kernels/block_sums.h"
#include "pipeline/kernels/median_row.h"
#include "pipeline/kernels/pair_features.h"
#include "pipeline/kernels/plane_fit.h"
#include "pipeline/kernels/pose_rating.h"
#include "pipeline/kernels/range_levels.h"
#include "pipeline/kernels/range_rows.h"
#include "pipeline/kernels/rigid_pairs.h"
#include "pipeline/kernels/spin_cells.h"
#include "pipeline/kernels/surface_changes.h"
#include "pipeline/kernels/surface_pairs.h"
#include "pipeline/kernels/weighted_rows.h"
#include "pipeline/kernels/window_nearest.h"
#include "pipeline/kernels/within.h"

namespace grapnel::kernels::reference {

// The kernels' operations as plain loops: same arguments, same meaning.

std::size_t select_within(const PointPlanes& points, std::span<const PointRange> ranges,
                          const Sphere& sphere, std::int32_t* position, float* squared_m2) noexcept;

void add_sphere_moments(const PointPlanes& points, std::span<const PointRange> ranges,
                        const Sphere& sphere, PartialMoments& partial) noexcept;

void median_row(const std::uint16_t* const* rows, int window, std::size_t width,
                std::uint16_t* out) noexcept;

std::size_t support_row(const std::uint16_t* above, const std::uint16_t* row,
                        const std::uint16_t* below, const GapLaw& gap, int min_support,
                        std::size_t width, std::uint16_t* out) noexcept;

void back_project_row(const std::uint16_t* depth, const RowCamera& camera, std::size_t width,
                      float* x, float* y, float* z) noexcept;

void pair_bins(const float* points, std::int32_t point_i, std::span<const std::int32_t> others,
               std::int32_t* bins) noexcept;

void count_pair_cells(const OrientedPlanes& points, std::size_t count, int bins,
                      const PairCellCounts& counts) noexcept;

void spin_votes(const OrientedPlanes& points, const SpinFrame& frame,
                std::span<const std::int32_t> others, const SpinVotes& votes) noexcept;

void best_rows(RowScore score, const RowBlocks& rows, const float* const* queries,
               std::size_t count, std::size_t kept, BestRow* const* best) noexcept;

void move_block(const Motion& motion, PointBlock& block) noexcept;

void find_voxels(const VoxelShape& shape, const float* x, const float* y, const float* z,
                 std::size_t count, std::int32_t* voxel) noexcept;

void add_plane_pairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                     PlaneSums& sums) noexcept;

void add_point_pairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                     PointSums& sums) noexcept;

[[nodiscard]] Sight rate_sight(const OrientedPlanes& samples, std::size_t count,
                               const Motion& motion, const SignedDepth& pixels,
                               const SightLaw& law) noexcept;

[[nodiscard]] float rate_on_surface(const OrientedPlanes& samples, std::size_t count,
                                    const Motion& motion, const NamedSurface& surface,
                                    float tolerance_m, float cos_normal) noexcept;

[[nodiscard]] float rate_in_field(const OrientedPlanes& samples, std::size_t count,
                                  const Motion& motion, const LevelField& field) noexcept;

void add_weighted_row(const float* row, std::span<const std::int32_t> targets, const float* weights,
                      std::size_t stride, float* matrix) noexcept;

std::size_t select_rows(std::span<const std::int32_t> position, const float* squared_m2,
                        const std::int32_t* row_at, std::int32_t* rows, float* weights) noexcept;

std::size_t count_inliers(const PairPlanes& pairs, std::size_t count, const RigidMotion& motion,
                          float squared_m2) noexcept;

void agreeing_pairs(const PairPlanes& pairs, std::size_t count, std::size_t pair_i,
                    const PairAgreement& agreement, std::uint64_t* bits) noexcept;

void near_members(const BoxPlanes& boxes, const float* begin, std::span<const PointRange> ranges,
                  const Box& box, float squared_m2, Stretches& members) noexcept;

void block_scatter(const PointPlanes& points, const BlockOfPoints& block,
                   std::span<const PointRange> ranges, float squared_m2, bool first,
                   float (*sums)[kBlock]) noexcept;

void block_normals(const PointPlanes& points, const NormalPlanes& normals,
                   const BlockOfPoints& block, std::span<const PointRange> ranges, float squared_m2,
                   bool about, float (*sums)[kBlock]) noexcept;

void ranges(const RangePlanes& row, std::ptrdiff_t count, float* range, float* nearest,
            float* farthest) noexcept;

void halve_row(const RangeRow& from, std::ptrdiff_t stride, std::ptrdiff_t count,
               const MutableRangeRow& to) noexcept;

[[nodiscard]] std::uint32_t face_camera(const RangePlanes& image, std::ptrdiff_t at,
                                        const VectorPlanes& normals, float* reach_m2) noexcept;

void smooth_scores(const float* scores, std::ptrdiff_t at, std::ptrdiff_t stride, float least,
                   float* out) noexcept;

void add_votes(const ChangePlanes& changes, std::span<const ChangeRow> rows, const ChangeView& view,
               ChangeVotes& votes) noexcept;

[[nodiscard]] float spread_of(const ChangeVotes& votes) noexcept;

void open_pixels(const RangePlanes& image, const std::uint8_t* state, std::ptrdiff_t at,
                 const PixelWindow& window, const Sphere& sphere, std::uint64_t* open) noexcept;

// Sums and roots in double: equal within the rounding of single precision, not bit by bit. These
// take memory from the heap.

void fit_patches(const RangePlanes& image, std::ptrdiff_t at, float* ninth_m2,
                 const Spread& out) noexcept;

void jumps(const RangePlanes& image, const JumpPlanes& planes, std::ptrdiff_t at,
           std::ptrdiff_t step, float* out) noexcept;

void beam_spread(const RangePlanes& normals, const float* code, std::ptrdiff_t at, float* count,
                 const Spread& out) noexcept;

void nearest_in_window(const PixelPlanes& planes, std::ptrdiff_t first,
                       const WindowSelection& selection, float* sum_m, float* farthest_m2) noexcept;

void fit_planes(const FitRow& row, std::size_t count, float* nx, float* ny, float* nz) noexcept;

}  // namespace grapnel::kernels::reference
