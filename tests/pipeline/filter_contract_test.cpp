// What every filter of the registry keeps to: degenerate clouds end in a named
// error or a cloud that is still one, and nothing is taken from the heap after reserve().
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "base/config.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

template <class StageKind>
std::unique_ptr<StageKind> with_defaults(const Method<StageKind>& method) {
  const ConfigTable empty("", std::string(method.name), 0);
  ConfigReader reader(empty);
  return method.make(reader);
}

enum class Shape { Empty, One, Line, Plane, Identical, NotANumber, Infinite, Cloud, Grid };

struct Degenerate {
  Shape shape;
  const char* name;
};
constexpr Degenerate kShapes[] = {
    {Shape::Empty, "Empty"},         {Shape::One, "One"},
    {Shape::Line, "Line"},           {Shape::Plane, "Plane"},
    {Shape::Identical, "Identical"}, {Shape::NotANumber, "NotANumber"},
    {Shape::Infinite, "Infinite"},   {Shape::Cloud, "Cloud"},
    {Shape::Grid, "Grid"},
};

test::OwnedSurface make(Shape shape) {
  if (shape == Shape::Grid) return test::wavy_grid(80, 60, 3);
  test::OwnedSurface cloud = test::random_cloud(600, 0.3, 4);
  cloud->spacing_m = 0.01;
  for (std::size_t i = 0; i < 600; ++i) {
    cloud->nz[i] = -1.0F;
    const float t = 0.001F * static_cast<float>(i);
    if (shape == Shape::Line) cloud->x[i] = cloud->y[i] = cloud->z[i] = t;
    if (shape == Shape::Plane) cloud->z[i] = 1.0F;
    if (shape == Shape::Identical) cloud->x[i] = cloud->y[i] = cloud->z[i] = 1.0F;
  }
  if (shape == Shape::NotANumber) cloud->y[77] = std::numeric_limits<float>::quiet_NaN();
  if (shape == Shape::Infinite) cloud->z[599] = std::numeric_limits<float>::infinity();
  if (shape == Shape::Empty) cloud->size = 0;
  if (shape == Shape::One) cloud->size = 1;
  return cloud;
}

void expect_a_cloud(const Surface& surface) {
  for (std::size_t i = 0; i < surface.size; ++i) {
    ASSERT_TRUE(surface.point(i).allFinite()) << i;
    ASSERT_TRUE(surface.normal(i).allFinite()) << i;
  }
  if (!surface.organised()) return;
  for (std::size_t i = 0; i < surface.size; ++i) {
    ASSERT_EQ(surface.grid.point_of[static_cast<std::size_t>(surface.grid.pixel_of[i])],
              static_cast<std::int32_t>(i));
  }
}

class EveryFilter : public testing::TestWithParam<std::size_t> {};

TEST_P(EveryFilter, EndsDegenerateCloudsInANamedErrorOrACloud) {
  const Method<CloudFilter>& method = cloud_filters()[GetParam()];
  for (const Degenerate& degenerate : kShapes) {
    SCOPED_TRACE(degenerate.name);
    const std::unique_ptr<CloudFilter> filter = with_defaults(method);
    const test::ArenaMemory memory(
        [&](Arena& arena) { filter->reserve(arena, test::small_limits()); });
    test::OwnedSurface surface = make(degenerate.shape);
    const std::size_t before = surface->size;
    const Result<std::size_t> removed = filter->apply(*surface);
    const bool refused = degenerate.shape == Shape::Empty ||
                         degenerate.shape == Shape::NotANumber ||
                         degenerate.shape == Shape::Infinite;
    if (refused) {
      ASSERT_FALSE(removed.ok());
    }
    if (!removed.ok()) {
      EXPECT_NE(removed.error().code, Code::Ok);
      EXPECT_NE(removed.error().stage, Stage::None);
      EXPECT_EQ(surface->size, before) << "an error leaves the cloud as it was";
      continue;
    }
    EXPECT_EQ(surface->size + removed.value(), before);
    expect_a_cloud(*surface);
  }
}

TEST_P(EveryFilter, RefusesMorePointsThanItHasRoomFor) {
  const std::unique_ptr<CloudFilter> filter = with_defaults(cloud_filters()[GetParam()]);
  Limits limits = test::small_limits();
  limits.max_points = limits.max_input_points = limits.max_model_points = 100;
  const test::ArenaMemory memory([&](Arena& arena) { filter->reserve(arena, limits); });
  test::OwnedSurface surface = make(Shape::Cloud);
  const Result<std::size_t> removed = filter->apply(*surface);
  ASSERT_FALSE(removed.ok());
  EXPECT_EQ(removed.error().code, Code::CapacityExceeded);
}

TEST_P(EveryFilter, TakesNothingFromTheHeapAfterReserve) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  const std::unique_ptr<CloudFilter> filter = with_defaults(cloud_filters()[GetParam()]);
  const test::ArenaMemory memory(
      [&](Arena& arena) { filter->reserve(arena, test::small_limits()); });
  EXPECT_EQ(memory.measured_bytes(), memory.used_bytes());
  for (const Shape shape : {Shape::Cloud, Shape::Grid}) {
    test::OwnedSurface surface = make(shape);
    test::arm_heap_guard();
    (void)filter->apply(*surface);
    test::disarm_heap_guard();
    EXPECT_EQ(test::heap_calls(), 0U);
  }
}

TEST_P(EveryFilter, DoesTheSameTwice) {
  const std::unique_ptr<CloudFilter> filter = with_defaults(cloud_filters()[GetParam()]);
  const test::ArenaMemory memory(
      [&](Arena& arena) { filter->reserve(arena, test::small_limits()); });
  for (const Shape shape : {Shape::Cloud, Shape::Grid}) {
    test::OwnedSurface first = make(shape);
    test::OwnedSurface second = make(shape);
    (void)filter->apply(*first);
    (void)filter->apply(*second);
    ASSERT_EQ(first->size, second->size);
    for (std::size_t i = 0; i < first->size; ++i) ASSERT_EQ(first->point(i), second->point(i));
  }
}

INSTANTIATE_TEST_SUITE_P(OfTheRegistry, EveryFilter,
                         testing::Range<std::size_t>(0, cloud_filters().size()),
                         [](const auto& filter) {
                           return std::string(cloud_filters()[filter.param].name);
                         });

}  // namespace
}  // namespace grapnel
