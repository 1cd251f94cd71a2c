#include "firmware_app/background.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <vector>

#include "base/input_error.h"
#include "base/rng.h"
#include "firmware_app/plane_fit.h"
#include "firmware_app/realtime.h"
#include "tests/firmware_app/fakes.h"

namespace grapnel {
namespace {

constexpr Intrinsics kCamera{160, 120, 143.0, 143.0, 79.5, 59.5};

/// Depth counts (mm) of a plane n·p + offset = 0, seen through kCamera.
std::vector<std::uint16_t> plane_image(const Vec3d& normal, double offset_m) {
  std::vector<std::uint16_t> image;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const Vec3d ray((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1.0);
      image.push_back(static_cast<std::uint16_t>(std::lround(-offset_m / normal.dot(ray) * 1000)));
    }
  }
  return image;
}

DepthFrame frame_of(const std::vector<std::uint16_t>& image) {
  DepthFrame frame;
  frame.depth = {image.data(), kCamera.width, kCamera.height};
  frame.intrinsics = kCamera;
  return frame;
}

class BackgroundTest : public ::testing::Test {
 protected:
  void make(Background& background) {
    const std::size_t bytes = 6 * 160 * 120 * sizeof(std::uint16_t);
    blocks_.push_back(std::make_unique<MemoryBlock>(bytes));
    Arena arena(blocks_.back()->span());
    background.reserve(arena, 160, 120, 3);
  }
  BackgroundTest() { make(background_); }

  std::vector<std::unique_ptr<MemoryBlock>> blocks_;
  Background background_;
  test::TemporaryFolder folder_;
  const Vec3d normal_ = Vec3d(0.05, -0.1, -1.0).normalized();
};

TEST(PlaneFit, FindsATiltedPlaneUnderClutter) {
  const Vec3d normal = Vec3d(0.05, -0.1, -1.0).normalized();
  std::vector<std::uint16_t> image = plane_image(normal, 1.1);
  for (int v = 30; v < 90; ++v) {  // a box of 30 cm height on a quarter of the image
    for (int u = 40; u < 120; ++u) image[static_cast<std::size_t>(v * 160 + u)] = 800;
  }
  Rng rng(3);
  for (std::uint16_t& count : image) {
    if (rng.uniform() < 0.1) count = 0;
  }
  const FittedPlane plane =
      fit_dominant_plane({image.data(), kCamera.width, kCamera.height}, 0.001, kCamera);
  ASSERT_TRUE(plane.found);
  // Counts of a millimetre have a standard deviation of 0.3 mm; hundreds of them average far below.
  EXPECT_NEAR(plane.offset_m, 1.1, 1e-3);
  EXPECT_GT(plane.normal.dot(normal), std::cos(2e-3));
}

TEST(PlaneFit, FindsNoneInNoise) {
  Rng rng(5);
  std::vector<std::uint16_t> image(160 * 120);
  for (std::uint16_t& count : image) count = static_cast<std::uint16_t>(500 + rng.below(3000));
  EXPECT_FALSE(
      fit_dominant_plane({image.data(), kCamera.width, kCamera.height}, 0.001, kCamera).found);
  std::fill(image.begin(), image.end(), std::uint16_t{0});
  EXPECT_FALSE(
      fit_dominant_plane({image.data(), kCamera.width, kCamera.height}, 0.001, kCamera).found);
}

TEST_F(BackgroundTest, TakesTheMedianAndSkipsHoles) {
  std::vector<std::uint16_t> image = plane_image(normal_, 1.1);
  const std::uint16_t truth = image[500];
  ASSERT_TRUE(background_.begin());
  for (const int offset : {0, 7, -200}) {
    image[500] = static_cast<std::uint16_t>(truth + offset);
    image[501] = offset == 0 ? std::uint16_t{900} : std::uint16_t{0};
    ASSERT_TRUE(background_.add(frame_of(image)));
  }
  ASSERT_TRUE(background_.finish());
  const BeltBackground belt = background_.view(frame_of(image));
  ASSERT_FALSE(belt.depth.empty());
  EXPECT_EQ(belt.depth.data[500], truth);
  EXPECT_EQ(belt.depth.data[501], 0);  // a reading in one frame of three is no belt
  ASSERT_TRUE(belt.has_plane);
  EXPECT_NEAR(belt.plane_offset_m, 1.1, 1e-3);
}

TEST_F(BackgroundTest, IsEmptyUntilTaughtAndForOtherShapes) {
  const std::vector<std::uint16_t> image = plane_image(normal_, 1.1);
  EXPECT_TRUE(background_.view(frame_of(image)).depth.empty());
  ASSERT_TRUE(background_.begin());
  ASSERT_TRUE(background_.add(frame_of(image)));
  ASSERT_TRUE(background_.finish());
  DepthFrame other = frame_of(image);
  other.depth.height = 100;
  EXPECT_TRUE(background_.view(other).depth.empty());
  other = frame_of(image);
  other.metres_per_unit = 0.0002;
  EXPECT_TRUE(background_.view(other).depth.empty());
}

TEST_F(BackgroundTest, RefusesAnEmptyViewAndKeepsTheOldOne) {
  const std::vector<std::uint16_t> image = plane_image(normal_, 1.1);
  ASSERT_TRUE(background_.begin());
  ASSERT_TRUE(background_.add(frame_of(image)));
  ASSERT_TRUE(background_.finish());
  background_.save_if_learned(folder_.path() / "b");
  const std::vector<std::uint16_t> dark(image.size(), 0);
  ASSERT_TRUE(background_.begin());
  ASSERT_TRUE(background_.add(frame_of(dark)));
  const Status learned = background_.finish();
  ASSERT_FALSE(learned);
  EXPECT_EQ(learned.error().code, Code::DepthMostlyInvalid);
  EXPECT_FALSE(background_.view(frame_of(image)).depth.empty());
}

TEST_F(BackgroundTest, AFixedPlaneBeatsTheFittedOne) {
  background_.set_plane(Vec3d(0.0, 0.0, -1.0), 0.9);
  const std::vector<std::uint16_t> image = plane_image(normal_, 1.1);
  const BeltBackground belt = background_.view(frame_of(image));
  EXPECT_TRUE(belt.has_plane);
  EXPECT_TRUE(belt.depth.empty());
  EXPECT_EQ(belt.plane_offset_m, 0.9);
}

TEST_F(BackgroundTest, SurvivesARestart) {
  const std::vector<std::uint16_t> image = plane_image(normal_, 1.1);
  ASSERT_TRUE(background_.begin());
  ASSERT_TRUE(background_.add(frame_of(image)));
  ASSERT_TRUE(background_.finish());
  const std::filesystem::path file = folder_.path() / "background.bin";
  EXPECT_FALSE(background_.begin());  // not before it is saved
  background_.save_if_learned(file);
  EXPECT_TRUE(background_.begin());
  Background next;
  make(next);
  EXPECT_FALSE(next.load(folder_.path() / "none"));
  ASSERT_TRUE(next.load(file));
  const BeltBackground belt = next.view(frame_of(image));
  ASSERT_EQ(belt.depth.pixels(), image.size());
  EXPECT_TRUE(std::equal(image.begin(), image.end(), belt.depth.data));
  EXPECT_EQ(belt.plane_offset_m, background_.view(frame_of(image)).plane_offset_m);
}

TEST_F(BackgroundTest, RefusesADamagedFileWithAClearLine) {
  const std::vector<std::uint16_t> image = plane_image(normal_, 1.1);
  ASSERT_TRUE(background_.begin());
  ASSERT_TRUE(background_.add(frame_of(image)));
  ASSERT_TRUE(background_.finish());
  const std::filesystem::path file = folder_.path() / "background.bin";
  background_.save_if_learned(file);
  {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(5000);
    stream.put('x');
  }
  EXPECT_THROW((void)background_.load(file), InputError);
  std::filesystem::resize_file(file, 3000);
  EXPECT_THROW((void)background_.load(file), InputError);
  std::filesystem::resize_file(file, 3);
  EXPECT_THROW((void)background_.load(file), InputError);
}

}  // namespace
}  // namespace grapnel
