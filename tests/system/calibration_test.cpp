// A sensor whose depth is wrong in a known way, from recordings of a wall over `grapnel calibrate
// depth` to the daemon that corrects it.
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/modbus/registers.h"
#include "drivers/replay/recording.h"
#include "drivers/replay/recording_writer.h"
#include "tests/system/daemon_process.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocal_px = 287.5;
constexpr double kUnit_m = 0.0002;
// 1/z = (1/z_true - offset) / scale: 32 mm too near at 1.1 m; and a lens that bows depth outward by
// 2 % at the corners at 1 m, in proportion to the distance.
constexpr double kOffset = 0.01;
constexpr double kScale = 0.96;
constexpr double kBow = 0.02;
constexpr int kBeltResidual =
    static_cast<int>(registers::diagnostics::kBeltResidualUm - registers::diagnostics::kFrames) / 2;

double measured_m(double z_m, int u, int v) {
  const double x = u - 159.5;
  const double y = v - 119.5;
  const double bow = 1.0 + kBow * (x * x + y * y) / (200.0 * 200.0) * z_m;
  return bow * kScale / (1.0 / z_m - kOffset);
}

/// A plane `distance_m` away along the optical axis, tilted about the image's u axis.
double wall_z_m(double distance_m, double tilt_rad, int v) {
  return distance_m / (1.0 + std::tan(tilt_rad) * (v - 119.5) / kFocal_px);
}

class Calibration : public testing::Test {
 protected:
  /// Exit status of a grapnel command; what it says goes to out.txt.
  [[nodiscard]] int grapnel(const std::string& arguments) const {
    const std::string command = std::string(GRAPNEL_BINARY_DIR) + "/bin/grapnel " + arguments +
                                " > " + (site_.folder() / "out.txt").string() + " 2>&1";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (site_.folder() / name).string();
  }

  /// A wall as the wrong sensor records it: the simulated sensor's noise, steps and gaps, then the
  /// error.
  void record_wall(const std::string& name, double distance_m, double tilt_rad) const {
    site_.write("wall.toml",
                "[scene]\nframes = 20\nrate_hz = 30.0\n[camera]\nwidth = 320\n"
                "height = 240\nfx = 287.5\nfy = 287.5\ncx = 159.5\ncy = 119.5\n"
                "color = false\nmetres_per_unit = 0.0002\nserial = \"UNIT7\"\n"
                "height_m = " +
                    std::to_string(distance_m * std::cos(tilt_rad)) +
                    "\ntilt_rad = " + std::to_string(tilt_rad) + "\n");
    ASSERT_EQ(grapnel("simulate " + path("wall.toml") + " -o " + path(name + "-true")), 0)
        << site_.read("out.txt");
    const Recording truth = Recording::open(path(name + "-true"));
    RecordingWriter writer(path(name), truth.camera());
    std::vector<std::uint16_t> depth(std::size_t{kWidth} * kHeight);
    for (std::size_t frame = 0; frame < truth.frame_count(); ++frame) {
      truth.read_frame(frame, depth, {});
      for (std::size_t i = 0; i < depth.size(); ++i) {
        if (depth[i] == 0) continue;
        const double z_m = measured_m(depth[i] * kUnit_m, static_cast<int>(i) % kWidth,
                                      static_cast<int>(i) / kWidth);
        depth[i] = static_cast<std::uint16_t>(std::lround(z_m / kUnit_m));
      }
      writer.add_depth(truth.time_us(frame), {depth.data(), kWidth, kHeight});
    }
  }
  void calibrate() const {
    record_wall("near", 0.8, 0.1);
    record_wall("middle", 1.2, -0.15);
    record_wall("far", 1.8, 0.2);
    fs::create_directory(path("cameras"));
    ASSERT_EQ(grapnel("calibrate depth " + path("near") + "=0.8 " + path("middle") + "=1.2 " +
                      path("far") + "=1.8 -o " + path("cameras/UNIT7.toml")),
              0)
        << site_.read("out.txt");
  }
  /// Root mean square of a recording's depth from a wall's truth, metres.
  [[nodiscard]] double error_m(const std::string& name, double distance_m, double tilt_rad) const {
    const Recording recording = Recording::open(path(name));
    std::vector<std::uint16_t> depth(std::size_t{kWidth} * kHeight);
    double square = 0.0;
    std::size_t count = 0;
    for (std::size_t frame = 0; frame < recording.frame_count(); ++frame) {
      recording.read_frame(frame, depth, {});
      for (std::size_t i = 0; i < depth.size(); ++i) {
        if (depth[i] == 0) continue;
        const double off =
            depth[i] * kUnit_m - wall_z_m(distance_m, tilt_rad, static_cast<int>(i) / kWidth);
        square += off * off;
        ++count;
      }
    }
    EXPECT_GT(count, depth.size() * recording.frame_count() / 2);
    return std::sqrt(square / static_cast<double>(count));
  }
  void configure(const std::string& recording, const std::string& camera_keys) const {
    site_.write("grapnel.toml",
                "active_preset = 10\nauto_arm = true\n[camera]\ndriver = \"replay\"\nloop = true\n"
                "path = \"" +
                    recording + "\"\n" + camera_keys +
                    "[capture]\nmax_width = 320\nmax_height = 240\ncolor = false\n"
                    "[belt]\nplane = [0.0, 0.0, -1.0, 1.1]\n[fieldbus]\nport = 0\n"
                    "[memory]\nbudget_mb = 128\n");
  }
  /// Where a daemon on that recording sees the belt that is 1.1 m away, metres.
  [[nodiscard]] double belt_residual_m(const std::string& recording,
                                       const std::string& camera_keys) const {
    configure(recording, camera_keys);
    test::DaemonProcess daemon(site_);
    EXPECT_TRUE(daemon.wait_ready());
    test::Plc plc(daemon.port());
    EXPECT_TRUE(test::eventually([&] { return plc.diagnostic(kBeltResidual) != 0; }));
    return 1e-6 * static_cast<std::int32_t>(plc.diagnostic(kBeltResidual));
  }

  test::Site site_;
};

TEST_F(Calibration, OfAWrongSensorMakesItRightOnAWallThatItHasNotSeen) {
  calibrate();
  record_wall("unseen", 1.4, -0.1);
  const double before_m = error_m("unseen", 1.4, -0.1);
  EXPECT_GT(before_m, 0.02) << "law and bow";
  // The simulated sensor's own noise at the wall, which no calibration takes away.
  const double noise_m = error_m("unseen-true", 1.4, -0.1);
  EXPECT_LT(noise_m, 0.004);
  ASSERT_EQ(grapnel("record replay path=" + path("unseen") + " calibration=" + path("cameras") +
                    " --frames 20 -o " + path("corrected")),
            0)
      << site_.read("out.txt");
  const double left_m = error_m("corrected", 1.4, -0.1);
  // What may be left beside the noise: the bow makes a wall look tilted, and its tilt is taken from
  // the wall itself; 0.2 % of the distance.
  EXPECT_LT(left_m, std::hypot(noise_m, 0.0028));
  std::printf("off by %.2f mm, corrected %.2f mm, of which %.2f mm are noise\n", 1e3 * before_m,
              1e3 * left_m, 1e3 * noise_m);
}

TEST_F(Calibration, KeyedBySerialIsUsedByTheDaemon) {
  calibrate();
  record_wall("belt", 1.1, 0.0);
  // 1.1 m is measured as 1.068 m.
  EXPECT_NEAR(belt_residual_m("belt", ""), 1.1 - measured_m(1.1, 160, 120), 0.01);
  // One step of the sensor at 1.1 m (2.9 mm z², Khoshelham and Elberink 2012).
  EXPECT_LT(std::abs(belt_residual_m("belt", "calibration = \"cameras\"\n")), 0.0035);
  fs::rename(path("cameras/UNIT7.toml"), path("cameras/UNIT8.toml"));
  EXPECT_GT(belt_residual_m("belt", "calibration = \"cameras\"\n"), 0.02) << "another unit's";
}

TEST_F(Calibration, OfAnotherUnitIsRefusedByTheDaemonWith2005) {
  record_wall("belt", 1.1, 0.0);
  std::string camera = site_.read("belt/camera.toml");
  const std::size_t serial = camera.find("UNIT7");
  ASSERT_NE(serial, std::string::npos);
  camera.replace(serial, 5, "UNIT8");
  site_.write("other.toml", camera);
  configure("belt", "calibration = \"other.toml\"\n");
  test::DaemonProcess daemon(site_);
  ASSERT_TRUE(daemon.wait_ready());
  test::Plc plc(daemon.port());
  EXPECT_TRUE(test::eventually([&] { return plc.status().status_code == Code::WrongSerial; }));
  EXPECT_TRUE(daemon.says("\"UNIT8\" is not allowed; the camera is \"UNIT7\""));
}

}  // namespace
}  // namespace grapnel
