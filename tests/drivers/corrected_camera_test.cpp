#include "drivers/corrected_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/file.h"
#include "drivers/registry.h"
#include "drivers/replay/depth_correction.h"
#include "drivers/replay/durable_recording.h"
#include "drivers/replay/recording.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

constexpr int kWidth = test::kSmallWidth;
constexpr int kHeight = test::kSmallHeight;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

/// A grid whose multipliers are linear in the cells' centres and in the distance: what lies between
/// is then known exactly.
double multiplier(double u, double v, double z) {
  return 1.0 + 0.001 * (u - 10.0) + 0.002 * (v - 7.0) + 0.01 * (z - 1.0);
}

CameraFile with_grid() {
  CameraFile camera = test::small_camera();
  camera.grid_columns = 4;
  camera.grid_rows = 3;
  camera.grid_distances_m = {0.5, 1.0, 2.0};
  for (const double z : camera.grid_distances_m) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        camera.grid_multipliers.push_back(multiplier(8 * column + 3.5, 8 * row + 3.5, z));
      }
    }
  }
  return camera;
}

std::vector<std::uint16_t> corrected(const CameraFile& camera, std::uint16_t count) {
  const DepthCorrection correction(camera, camera.metres_per_unit);
  std::vector<std::uint16_t> depth(kPixels, count);
  std::vector<float> scratch(correction.scratch_floats());
  correction.apply(depth, scratch);
  return depth;
}

TEST(DepthCorrection, OfACameraThatNamesNoneChangesNothing) {
  EXPECT_TRUE(DepthCorrection(test::small_camera(), 0.001).empty());
  EXPECT_EQ(corrected(test::small_camera(), 1234), std::vector<std::uint16_t>(kPixels, 1234));
}

TEST(DepthCorrection, FollowsTheDisparityLaw) {
  CameraFile camera = test::small_camera();
  camera.disparity_law = {0.05, 0.9};
  for (const int count : {400, 1000, 3000}) {
    const double z = count * 0.001;
    const double expected_mm = 1000.0 / (0.05 + 0.9 / z);
    EXPECT_EQ(corrected(camera, static_cast<std::uint16_t>(count))[5], std::lround(expected_mm));
  }
  EXPECT_EQ(corrected(camera, 0)[5], 0) << "no reading stays none";
}

TEST(DepthCorrection, IsLinearBetweenCellsAndDistancesAndGoesOnToTheEdges) {
  const CameraFile camera = with_grid();
  for (const int count : {500, 700, 1000, 1600, 2000}) {
    const auto depth = corrected(camera, static_cast<std::uint16_t>(count));
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const double expected_mm = count * multiplier(u, v, count * 0.001);
        // Half a count of rounding, and floats.
        ASSERT_NEAR(depth[static_cast<std::size_t>(v * kWidth + u)], expected_mm, 0.51)
            << u << " " << v << " " << count;
      }
    }
  }
  // Beyond the nearest and farthest distance the multiplier is that of these.
  EXPECT_NEAR(corrected(camera, 300)[0], 300 * multiplier(0, 0, 0.5), 0.51);
  EXPECT_NEAR(corrected(camera, 4000)[0], 4000 * multiplier(0, 0, 2.0), 0.51);
}

TEST(DepthCorrection, MakesADepthThatNoLongerFitsNoReading) {
  CameraFile camera = test::small_camera();
  camera.disparity_law = {-0.02, 1.0};
  EXPECT_EQ(corrected(camera, 60'000)[5], 0) << "behind infinity";
}

class Corrected : public ::testing::Test {
 protected:
  Corrected() { test::write_small_recording(folder_ / "r", 3, false); }
  void calibrate(const CameraFile& camera, const std::string& name) {
    write_file(folder_ / name, camera_file_text(camera));
  }
  std::unique_ptr<Camera> make(const std::string& calibration) {
    return make_camera(
        parse_config("driver = \"replay\"\nmode = \"fast\"\npath = \"" + (folder_ / "r").string() +
                         "\"\ncalibration = \"" + (folder_ / calibration).string() + "\"\n",
                     "g.toml"),
        clock_);
  }
  /// The first frame that comes.
  FrameLease first(Camera& camera) {
    EXPECT_TRUE(camera.start(pool_, {}).ok()) << camera.problem();
    FrameLease lease;
    for (int look = 0; look < 2000 && !lease.valid(); ++look) {
      clock_.sleep_until_us(clock_.now_us() + 1000);
      lease = pool_.lease_first_since(0);
    }
    EXPECT_TRUE(lease.valid());
    return lease;
  }

  test::TempFolder folder_;
  MonotonicClock clock_;
  FramePool pool_{8, kWidth, kHeight, false};
};

TEST_F(Corrected, EveryFrameOfADriverHasTheFilesIntrinsicsAndDepth) {
  CameraFile camera = with_grid();
  camera.fx = 40.0;
  camera.ir_shift_px = {4.0, -3.0};
  camera.baseline_m = 0.07;
  calibrate(camera, "camera.toml");
  const auto tested = make("camera.toml");
  const Result<CameraInfo> info = tested->open();
  ASSERT_TRUE(info.ok()) << tested->problem();
  EXPECT_EQ(info.value().intrinsics.fx, 40.0);
  EXPECT_EQ(info.value().intrinsics.cx, 11.5) << "pixel u of the depth is u + 4 of the infrared";
  EXPECT_EQ(info.value().intrinsics.cy, 14.5);
  const FrameLease lease = first(*tested);
  const DepthFrame& frame = lease.frame();
  EXPECT_EQ(frame.intrinsics.cx, 11.5);
  EXPECT_EQ(frame.baseline_m, 0.07);
  const std::size_t number = frame.sequence % 3;
  for (std::size_t i = 0; i < kPixels; ++i) {
    bool some = false;
    for (std::size_t recorded = 0; recorded < 3; ++recorded) {
      const std::uint16_t raw = test::small_depth(recorded, i);
      const double u = static_cast<double>(i % kWidth);
      const double v = static_cast<double>(i / kWidth);
      some = some || std::abs(frame.depth.data[i] - raw * multiplier(u, v, raw * 0.001)) <= 0.51;
    }
    ASSERT_TRUE(some) << i << " of frame " << number;
  }
}

TEST_F(Corrected, AFolderHoldsAFileForEachUnit) {
  CameraFile camera = test::small_camera();
  camera.fx = 41.0;
  std::filesystem::create_directory(folder_ / "units");
  calibrate(camera, "units/SMALL-1.toml");
  const auto tested = make("units");
  ASSERT_TRUE(tested->open().ok());
  EXPECT_EQ(tested->open().value().intrinsics.fx, 41.0);
  std::filesystem::rename(folder_ / "units" / "SMALL-1.toml", folder_ / "units" / "OTHER.toml");
  const auto other = make("units");
  ASSERT_TRUE(other->open().ok());
  EXPECT_EQ(other->open().value().intrinsics.fx, 30.0) << "the device's own";
}

TEST_F(Corrected, AnotherUnitsFileIsRefused) {
  CameraFile camera = test::small_camera();
  camera.serial = "SMALL-2";
  calibrate(camera, "camera.toml");
  const auto tested = make("camera.toml");
  const Result<CameraInfo> info = tested->open();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.error().code, Code::WrongSerial);
  EXPECT_NE(tested->problem().find("camera.toml: serial: \"SMALL-2\" is not allowed; the camera is "
                                   "\"SMALL-1\""),
            std::string::npos)
      << tested->problem();
}

TEST_F(Corrected, AMissingFileIsAProblemOfTheConfiguration) {
  try {
    (void)make("absent.toml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find("g.toml:4: calibration: "), 0U) << error.what();
  }
}

TEST_F(Corrected, AFrameSaysSoAndSoDoesTheRecordingOfIt) {
  calibrate(with_grid(), "camera.toml");
  const auto tested = make("camera.toml");
  ASSERT_TRUE(tested->open().ok()) << tested->problem();
  const FrameLease lease = first(*tested);
  EXPECT_TRUE(lease.frame().corrected);
  EXPECT_TRUE(camera_file_of(lease.frame(), "SMALL-1").corrected);
}

TEST_F(Corrected, ARecordingOfCorrectedFramesIsNotCorrectedAgain) {
  CameraFile stored = test::small_camera();
  stored.corrected = true;
  calibrate(stored, "r/camera.toml");
  calibrate(with_grid(), "camera.toml");
  const auto tested = make("camera.toml");
  ASSERT_TRUE(tested->open().ok()) << tested->problem();
  const FrameLease lease = first(*tested);
  EXPECT_TRUE(lease.frame().corrected);
  const auto same_as = [&](std::size_t recorded) {
    for (std::size_t i = 0; i < kPixels; ++i) {
      if (lease.frame().depth.data[i] != test::small_depth(recorded, i)) return false;
    }
    return true;
  };
  EXPECT_TRUE(same_as(0) || same_as(1) || same_as(2));
}

TEST_F(Corrected, ARecordingsOwnCameraFileCorrectsItToo) {
  CameraFile camera = test::small_camera();
  camera.disparity_law = {0.0, 0.5};
  calibrate(camera, "r/camera.toml");
  const Recording recording = Recording::open(folder_ / "r");
  std::vector<std::uint16_t> depth(kPixels);
  recording.read_frame(0, depth, {});
  EXPECT_EQ(depth[1], 2 * test::small_depth(0, 1));
}

}  // namespace
}  // namespace grapnel
