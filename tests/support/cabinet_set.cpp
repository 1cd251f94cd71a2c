#include "tests/support/cabinet_set.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>

#include "base/cloud_file.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "tests/support/box_fit.h"

namespace grapnel::test {
namespace {

namespace fs = std::filesystem;

const Intrinsics kCamera = {640, 480, 535.4, 539.2, 320.1, 247.6};
constexpr double kMetresPerUnit = 0.0002;
constexpr double kReach_m = 0.09;

std::vector<double> numbers_of(const fs::path& file) {
  std::ifstream stream(file);
  std::vector<double> numbers;
  for (double number = 0.0; stream >> number;) numbers.push_back(number);
  if (numbers.empty()) throw InputError(file.string() + ": no numbers");
  return numbers;
}

/// x y z, turn about z.
Pose upright(const std::vector<double>& object) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.0, 0.0, object.at(3)));
  pose.translation() = Vec3d(object.at(0), object.at(1), object.at(2));
  return pose;
}

/// Row `index` of: time, tx ty tz, qx qy qz qw.
Pose camera_pose(const std::vector<double>& rows, int index) {
  const double* row = &rows.at(8 * static_cast<std::size_t>(index) + 7) - 7;
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(row[7], row[4], row[5], row[6]).normalized().matrix();
  pose.translation() = Vec3d(row[1], row[2], row[3]);
  return pose;
}

fs::path depth_file(const fs::path& folder, int index) {
  char name[32];
  std::snprintf(name, sizeof name, "%04d_depth_raw.png", index);
  return folder / "depth_imgs" / name;
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  if (!stream.flush()) throw InputError(file.string() + ": can't be written");
}

}  // namespace

std::vector<int> good_cabinet_images() {
  return {2, 5, 6, 9, 10, 12, 13, 27, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39};
}

CabinetSet read_cabinet(const fs::path& folder, const std::vector<int>& images) {
  const std::vector<double> object = numbers_of(folder / "truth_objects.txt");
  const std::vector<double> cameras = numbers_of(folder / "truth_cam_poses.txt");
  CabinetSet set;
  set.recorded_half_m = Vec3d(object.at(4), object.at(5), object.at(6));
  std::vector<BoxView> views;
  for (const int index : images) {
    const Pose start = camera_pose(cameras, index).inverse() * upright(object);
    const fs::path file = depth_file(folder, index);
    const DepthImage image = read_depth_png(file);
    views.push_back(
        box_view({image.view(), kMetresPerUnit, kCamera}, start, set.recorded_half_m, kReach_m));
    set.images.push_back({index, file, start, 0.0, 0.0});
  }
  set.half_m = set.recorded_half_m;
  fit_boxes(views, set.half_m);
  for (std::size_t i = 0; i < views.size(); ++i) {
    CabinetSet::Image& image = set.images[i];
    const Pose& refined = views[i].camera_from_box;
    image.moved_m = (refined.translation() - image.camera_from_box.translation()).norm();
    image.camera_from_box = refined;
    image.residual_m = median_residual_m(views[i], set.half_m);
  }
  return set;
}

CloudData box_cloud(const Vec3d& half_m, double spacing_m) {
  CloudData cloud;
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3;
    const int c = (axis + 2) % 3;
    const int rows = static_cast<int>(std::ceil(2.0 * half_m[b] / spacing_m));
    const int columns = static_cast<int>(std::ceil(2.0 * half_m[c] / spacing_m));
    for (int i = 0; i < 2 * rows * columns; ++i) {
      Vec3d normal = Vec3d::Zero();
      normal[axis] = i % 2 == 0 ? 1.0 : -1.0;
      Vec3d p = half_m.cwiseProduct(normal);
      p[b] = half_m[b] * ((2.0 * (i / 2 / columns) + 1.0) / rows - 1.0);
      p[c] = half_m[c] * ((2.0 * (i / 2 % columns) + 1.0) / columns - 1.0);
      cloud.x.push_back(static_cast<float>(p.x()));
      cloud.y.push_back(static_cast<float>(p.y()));
      cloud.z.push_back(static_cast<float>(p.z()));
      cloud.nx.push_back(static_cast<float>(normal.x()));
      cloud.ny.push_back(static_cast<float>(normal.y()));
      cloud.nz.push_back(static_cast<float>(normal.z()));
    }
  }
  cloud.width = static_cast<int>(cloud.size());
  return cloud;
}

void write_cabinet_suite(const CabinetSet& set, const Vec3d& model_half_m, const fs::path& folder) {
  fs::create_directories(folder);
  write_ply(folder / "box.ply", box_cloud(model_half_m, 0.008));
  write(folder / "box.toml", "unit_m = 1.0\nsymmetry = \"box\"\n");
  write(folder / "camera.toml",
        "width = 640\nheight = 480\nfx = 535.4\nfy = 539.2\ncx = 320.1\ncy = 247.6\n"
        "metres_per_unit = 0.0002\n");
  std::string text = "[suite]\nname = \"cabinet\"\ntolerance_m = 0.015\ntolerance_rad = 0.05236\n";
  for (const CabinetSet::Image& image : set.images) {
    text += "\n[[case]]\nid = \"image-" + std::to_string(image.index) +
            "\"\nkind = \"scene\"\nsource = \"box.ply\"\ntarget = \"" + image.depth.string() +
            "\"\ncamera = \"camera.toml\"\nsymmetry = \"box\"\nexpect = \"accept\"\n"
            "group = \"cabinet\"\ntruth = [";
    for (int i = 0; i < 16; ++i) {
      char number[40];
      std::snprintf(number, sizeof number, "%s%.12g", i == 0 ? "" : ", ",
                    image.camera_from_box.matrix()(i / 4, i % 4));
      text += number;
    }
    text += "]\n";
  }
  write(folder / "suite.toml", text);
}

}  // namespace grapnel::test
