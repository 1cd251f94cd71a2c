#pragma once

#include <filesystem>
#include <vector>

#include "base/cloud.h"
#include "base/geometry.h"

namespace grapnel::test {

/// A real box in a real camera's pictures: the keyframes of the TUM sequence freiburg3_cabinet,
/// whose recorded poses are 1 to 3 cm off and are refined on the depth with the box's length and
/// width.
struct CabinetSet {
  struct Image {
    int index = 0;
    std::filesystem::path depth;
    Pose camera_from_box = Pose::Identity();  ///< refined
    double moved_m = 0.0;                     ///< by the refinement, at the box's middle
    double residual_m = 0.0;                  ///< median distance to a face, after it
  };

  Vec3d recorded_half_m = Vec3d::Zero();
  Vec3d half_m = Vec3d::Zero();  ///< refined
  std::vector<Image> images;
};

/// The images whose recorded pose leaves at most 8 mm between readings and faces.
[[nodiscard]] std::vector<int> good_cabinet_images();

/// Reads the recording's folder and refines the given images together. Throws InputError.
[[nodiscard]] CabinetSet read_cabinet(const std::filesystem::path& folder,
                                      const std::vector<int>& images);

/// A box's six faces as points with outward normals, `spacing_m` apart.
[[nodiscard]] CloudData box_cloud(const Vec3d& half_m, double spacing_m);

/// Writes box.ply, box.toml, camera.toml and suite.toml for `grapnel evaluate`: right is 15 mm and
/// 3 degrees from the refined pose. Throws InputError.
void write_cabinet_suite(const CabinetSet& set, const Vec3d& model_half_m,
                         const std::filesystem::path& folder);

}  // namespace grapnel::test
