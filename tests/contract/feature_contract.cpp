#include "tests/contract/feature_contract.h"

#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <limits>

#include "pipeline/preprocess/normals.h"

namespace grapnel::test {

std::string case_name(const MethodCase& method) {
  std::string name = method.name + "_" + method.keys;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
}

Limits contract_limits() {
  Limits limits = small_limits();
  limits.max_points = 2000;
  limits.max_model_points = 2000;
  limits.max_keypoints = 200;
  limits.max_correspondences = 400;
  return limits;
}

OwnedSurface oriented_ball(std::size_t points) {
  OwnedSurface ball = bumpy_ball(points, 0.2);
  PcaNormals normals({});
  const ArenaMemory memory([&](Arena& arena) { normals.reserve(arena, small_limits()); });
  EXPECT_TRUE(normals.estimate(*ball).ok());
  return ball;
}

namespace {

/// Points by a rule, normals along z.
template <class Place>
OwnedSurface surface_by(std::size_t count, const Place& place) {
  OwnedSurface owned(std::max<std::size_t>(count, 1), 0);
  owned->size = count;
  owned->spacing_m = 0.01;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f p = place(static_cast<float>(i));
    owned->x[i] = p.x();
    owned->y[i] = p.y();
    owned->z[i] = p.z();
    owned->nz[i] = 1.0F;
  }
  return owned;
}

}  // namespace

std::vector<OddSurface> odd_surfaces() {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  std::vector<OddSurface> list;
  const auto add = [&](const char* name, OwnedSurface surface) {
    list.push_back({name, std::move(surface)});
  };
  const auto row_of_ten = [](float i) {
    const float row = std::floor(i / 10.0F);
    return Vec3f(0.01F * (i - 10.0F * row), 0.01F * row, 1.0F);
  };
  add("empty", surface_by(0, row_of_ten));
  add("one point", surface_by(1, row_of_ten));
  add("two points", surface_by(2, row_of_ten));
  add("plane", surface_by(100, row_of_ten));
  add("line", surface_by(100, [](float i) { return Vec3f(0.01F * i, 0.0F, 1.0F); }));
  add("line along the normals",
      surface_by(100, [](float i) { return Vec3f(0.0F, 0.0F, 0.01F * i); }));
  add("identical points", surface_by(100, [](float) { return Vec3f(0.1F, 0.2F, 0.3F); }));
  add("one NaN", surface_by(100, [&](float i) {
        return i == 50.0F ? Vec3f(kNan, 0.0F, 1.0F) : row_of_ten(i);
      }));
  add("all NaN", surface_by(100, [&](float) { return Vec3f(kNan, kNan, kNan); }));
  add("one infinite", surface_by(100, [&](float i) {
        return i == 50.0F ? Vec3f(std::numeric_limits<float>::infinity(), 0.0F, 1.0F)
                          : row_of_ten(i);
      }));
  add("far apart", surface_by(100, [](float i) { return Vec3f(1e6F * i, 0.0F, 0.0F); }));
  OwnedSurface bare = surface_by(100, row_of_ten);
  for (std::size_t i = 0; i < bare->size; ++i) bare->nz[i] = 0.0F;
  add("without normals", std::move(bare));
  OwnedSurface unspaced = surface_by(100, row_of_ten);
  unspaced->spacing_m = 0.0;
  add("without spacing", std::move(unspaced));
  return list;
}

std::vector<Keypoint> keypoints_of(const Surface& surface, std::size_t step) {
  std::vector<Keypoint> keypoints;
  for (std::size_t i = 0; i < surface.size; i += step) {
    keypoints.push_back({static_cast<std::int32_t>(i), 1.0F, 0.0F});
  }
  return keypoints;
}

}  // namespace grapnel::test
