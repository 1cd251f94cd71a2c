#include "workbench/simulate/part_instance.h"

#include <array>
#include <cmath>
#include <utility>

namespace grapnel {
namespace {

constexpr double kSizeSpread = 0.25;
constexpr double kLeastDifference = 0.125;

bool too_alike(const Vec3d& size_m) {
  for (int a = 0; a < 3; ++a) {
    for (int b = a + 1; b < 3; ++b) {
      if (std::fabs(size_m[a] - size_m[b]) < kLeastDifference * size_m[a]) return true;
    }
  }
  return false;
}

PartKind kind_of(PartClass part) {
  switch (part) {
    case PartClass::Carton:
      return PartKind::Carton;
    case PartClass::Barrel:
      return PartKind::Barrel;
    case PartClass::Sack:
      return PartKind::Sack;
    default:
      return PartKind::Box;
  }
}

/// The block is a tenth as high as the part, and lies nearer to one corner.
Mesh make_nearly_symmetric(const Vec3d& size_m) {
  const Vec3d high = 0.5 * size_m;
  const Vec3d low = -high;
  const double deck_m = high.z() - 0.1 * size_m.z();
  const Block blocks[] = {
      {low, {high.x(), high.y(), deck_m}, true},
      {{low.x() + 0.10 * size_m.x(), low.y() + 0.15 * size_m.y(), deck_m},
       {low.x() + 0.35 * size_m.x(), low.y() + 0.40 * size_m.y(), high.z()},
       true},
  };
  return make_blocks(blocks);
}

}  // namespace

std::string_view PartInstance::symmetry() const {
  return part == PartClass::NearlySymmetric ? "none" : symmetry_name(kind_of(part));
}

bool PartInstance::chiral() const { return symmetry() == "none"; }

PartInstance draw_instance(PartClass part, Rng& rng) {
  PartInstance instance;
  instance.part = part;
  const PartKind kind = kind_of(part);
  const Vec3d middle_m = default_size_m(kind);
  do {
    for (int axis = 0; axis < 3; ++axis) {
      instance.size_m[axis] = middle_m[axis] * rng.uniform(1.0 - kSizeSpread, 1.0 + kSizeSpread);
    }
    if (kind == PartKind::Barrel) instance.size_m.y() = instance.size_m.x();
  } while (kind != PartKind::Barrel && too_alike(instance.size_m));
  instance.mesh = part == PartClass::NearlySymmetric
                      ? make_nearly_symmetric(instance.size_m)
                      : make_shape(kind, instance.size_m, rng.next_u64());
  return instance;
}

Mesh scaled(const Mesh& mesh, double factor) {
  Mesh result = mesh;
  for (Vec3d& vertex : result.vertices) vertex *= factor;
  return result;
}

Mesh mirrored(const Mesh& mesh) {
  Mesh result = mesh;
  for (Vec3d& vertex : result.vertices) vertex.x() = -vertex.x();
  for (Mesh::Triangle& corner : result.triangles) std::swap(corner[1], corner[2]);
  return result;
}

Mesh make_arm() {
  constexpr double kFinger_m = 0.018;
  std::array<Block, 7> blocks;
  blocks[0] = {{-0.26, -0.04, -0.035}, {0.04, 0.04, 0.035}, true};  // forearm
  blocks[1] = {{0.04, -0.045, -0.015}, {0.14, 0.045, 0.02}, true};  // palm
  blocks[2] = {{0.06, 0.045, -0.012}, {0.12, 0.07, 0.008}, true};   // thumb
  constexpr std::array kReach_m = {0.21, 0.225, 0.22, 0.2};
  for (std::size_t i = 0; i < kReach_m.size(); ++i) {
    const double y = -0.043 + 0.0225 * static_cast<double>(i);
    blocks[3 + i] = {{0.14, y, -0.008}, {kReach_m[i], y + kFinger_m, 0.01}, true};
  }
  Mesh arm = make_blocks(blocks);
  centre(arm);
  return arm;
}

}  // namespace grapnel
