#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/synthetic/mesh.h"

namespace grapnel {

/// The parts that the simulator can make. All stand upright on z and have their frame's origin at
/// the centre of their bounds.
enum class PartKind : std::uint8_t {
  Box,     ///< plain cuboid: symmetric under the half turns about all three axes
  Carton,  ///< cuboid with an L-shaped step and a recess on top: no symmetry
  Barrel,  ///< drum with rims, hoops and a central bung: free rotation about z
  Sack,    ///< filled pillow with seeded wrinkles and a fold: no symmetry
  Mesh,    ///< read from a file
};

inline constexpr std::string_view kPartKindNames[] = {"box", "carton", "barrel", "sack", "mesh"};

/// Outer size of the part that ships as the kind's model, metres; zero for Mesh.
[[nodiscard]] Vec3d default_size_m(PartKind kind);
/// The kind's symmetry, as a model file names it.
[[nodiscard]] std::string_view symmetry_name(PartKind kind);
/// Seed of the sack that ships as a model.
inline constexpr std::uint64_t kModelSackSeed = 7;

[[nodiscard]] Mesh make_box(const Vec3d& size_m);
/// Details (step and recess) are kCartonStep_m high and deep; each size at least 5 of them.
[[nodiscard]] Mesh make_carton(const Vec3d& size_m);
/// size_m.x is the diameter over rims and hoops, size_m.z the height, size_m.y is not looked at.
[[nodiscard]] Mesh make_barrel(const Vec3d& size_m);
/// Wrinkles and fold depend on the seed alone.
[[nodiscard]] Mesh make_sack(const Vec3d& size_m, std::uint64_t seed);
/// Precondition: kind is not Mesh.
[[nodiscard]] Mesh make_shape(PartKind kind, const Vec3d& size_m, std::uint64_t seed);

/// Height of the carton's step and depth of its recess: about ten times a Kinect's noise at 1.2 m.
inline constexpr double kCartonStep_m = 0.03;

/// A cuboid that is filled or cut out.
struct Block {
  Vec3d low_m;
  Vec3d high_m;
  bool filled = true;
};

/// The closed surface of blocks put down or cut out one after the other.
[[nodiscard]] Mesh make_blocks(std::span<const Block> blocks);

}  // namespace grapnel
