#pragma once

#include <cstdint>
#include <string_view>

#include "base/rng.h"
#include "drivers/synthetic/mesh.h"
#include "drivers/synthetic/shapes.h"

namespace grapnel {

/// The kinds of part a qualification set can be about.
enum class PartClass : std::uint8_t {
  Box,
  Carton,
  Barrel,
  Sack,
  NearlySymmetric,  ///< a box with one low block near a corner of one face: 2 % of its surface
                    ///< tells
};
inline constexpr std::string_view kPartClassNames[] = {"box", "carton", "barrel", "sack",
                                                       "nearly_symmetric"};

/// One object of a class, with sizes of its own.
struct PartInstance {
  PartClass part = PartClass::Box;
  Vec3d size_m = Vec3d::Zero();
  Mesh mesh;

  /// As a model file names it.
  [[nodiscard]] std::string_view symmetry() const;
  /// Whether its mirror image is another part.
  [[nodiscard]] bool chiral() const;
};

/// Sizes within a quarter of the shipped model's, each at least an eighth from the others, so that
/// no symmetry arises that the class does not declare.
[[nodiscard]] PartInstance draw_instance(PartClass part, Rng& rng);

[[nodiscard]] Mesh scaled(const Mesh& mesh, double factor);
/// Mirrored in x, its normals still outward.
[[nodiscard]] Mesh mirrored(const Mesh& mesh);
/// A forearm with hand and fingers along x, some 0.5 m long, about its centre.
[[nodiscard]] Mesh make_arm();

}  // namespace grapnel
