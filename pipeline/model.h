#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/cloud.h"
#include "base/geometry.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Declared symmetry about the axes through the model frame's origin.
enum class Symmetry : std::uint8_t { None, X180, Y180, Z180, Box, AxisX, AxisY, AxisZ, AxisZFlip };

/// Grasp frame of a model, as taught.
struct Grasp {
  std::uint16_t id = 0;
  std::string name;
  Pose model_from_grasp = Pose::Identity();
  std::vector<std::string>
      required;  ///< directions that must be observable: "x" "y" "z" "rx" "ry" "rz"
};

/// A taught part as its file says it: points with outward normals in metres, symmetry and grasps.
/// Lives on the heap, made at load time; what the pipeline uses of it is carved into the arena.
struct Model {
  std::string name;
  std::uint16_t id = 0;  ///< the number the PLC knows it by
  std::vector<float> x, y, z, nx, ny, nz, intensity;
  Symmetry symmetry = Symmetry::None;
  std::vector<Grasp> grasps;  ///< at least one
  double diameter_m = 0.0;    ///< of the bounding box
  double spacing_m = 0.0;     ///< mean distance of a point to its nearest neighbour
  std::uint64_t hash = 0;     ///< of the file's bytes

  [[nodiscard]] std::size_t size() const noexcept { return x.size(); }
};

/// A model from a cloud in memory: points in `unit_m` metres, no symmetry, one grasp at its origin.
/// Throws InputError.
[[nodiscard]] Model model_from_cloud(const CloudData& cloud, const std::string& name,
                                     double unit_m = 1.0);

/// Reads NAME.ply or .pcd and, where it exists, NAME.toml beside it. Normals are computed where
/// absent, outward from the cloud's centre. Throws InputError.
[[nodiscard]] Model load_model(const std::filesystem::path& file);

/// True when `a` and `b` are the same pose of a model with this symmetry, within the tolerances.
[[nodiscard]] bool equivalent(const Pose& a, const Pose& b, Symmetry symmetry, double tolerance_m,
                              double tolerance_rad) noexcept;

/// The pose equivalent to `found` under the symmetry that is nearest in rotation to `reference`.
[[nodiscard]] Pose nearest_equivalent(const Pose& found, const Pose& reference,
                                      Symmetry symmetry) noexcept;

/// Of all equivalent poses the one whose grasp is best reached from the camera: the grasp nearest
/// to it, and of equally near ones the grasp frame's axes nearest to the camera's own. The same
/// part gets the same answer wherever the search began.
[[nodiscard]] Pose canonical_pose(const Pose& camera_from_model, const Pose& model_from_grasp,
                                  Symmetry symmetry) noexcept;

/// 0, 1 or 2: the axis about which the model turns freely; -1: none.
[[nodiscard]] int free_axis(Symmetry symmetry) noexcept;
/// "none", "x180", …; the reverse throws InputError.
[[nodiscard]] const char* symmetry_name(Symmetry symmetry) noexcept;
[[nodiscard]] Symmetry symmetry_from_name(const std::string& name);

}  // namespace grapnel
