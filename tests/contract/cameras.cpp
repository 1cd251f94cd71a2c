// The drivers that the camera contract suite runs on: a new one is a class and a line below.
#include <fstream>

#include "drivers/registry.h"
#include "drivers/replay/replay_camera.h"
#include "drivers/synthetic/synthetic_camera.h"
#include "tests/contract/camera_contract.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel::test {
namespace {

CameraInfo declared_replay(bool with_color) {
  const CameraFile camera = small_camera();
  CameraInfo info;
  info.driver = "replay";
  info.serial = camera.serial;
  info.intrinsics = camera.intrinsics();
  info.metres_per_unit = camera.metres_per_unit;
  info.baseline_m = camera.baseline_m;
  info.has_color = with_color;
  info.live = false;
  return info;
}

class ReplayUnderTest final : public CameraUnderTest {
 public:
  ReplayUnderTest(ReplayMode mode, bool with_color) : with_color_(with_color) {
    write_small_recording(folder_ / "r", 7, with_color);
    options_.path = (folder_ / "r").string();
    options_.mode = mode;
    options_.loop = true;
  }
  [[nodiscard]] std::unique_ptr<Camera> make(const Clock& clock) override {
    return std::make_unique<ReplayCamera>(options_, clock);
  }
  [[nodiscard]] CameraInfo declared() const override { return declared_replay(with_color_); }

 private:
  TempFolder folder_;
  ReplayOptions options_;
  bool with_color_;
};

class SyntheticUnderTest final : public CameraUnderTest {
 public:
  explicit SyntheticUnderTest(SyntheticPace mode) {
    options_.scene = (folder_ / "scene.toml").string();
    options_.mode = mode;
    std::ofstream(options_.scene) << "[scene]\nframes = 5\nrate_hz = 60.0\n"
                                     "[camera]\nwidth = 64\nheight = 48\nfx = 55.0\nfy = 55.0\n"
                                     "cx = 31.5\ncy = 23.5\nserial = \"SIM-1\"\n"
                                     "[belt]\nspeed_m_s = 0.1\n[[part]]\nkind = \"box\"\n";
  }
  [[nodiscard]] std::unique_ptr<Camera> make(const Clock& clock) override {
    return std::make_unique<SyntheticCamera>(options_, clock);
  }
  [[nodiscard]] CameraInfo declared() const override {
    CameraInfo info;
    info.driver = "synthetic";
    info.serial = "SIM-1";
    info.intrinsics = {64, 48, 55.0, 55.0, 31.5, 23.5};
    info.metres_per_unit = 0.001;
    info.baseline_m = 0.075;
    info.has_color = true;
    info.live = false;
    return info;
  }
  void lose_device(Camera& camera) override { dynamic_cast<SyntheticCamera&>(camera).unplug(); }
  void return_device(Camera& camera) override { dynamic_cast<SyntheticCamera&>(camera).replug(); }

 private:
  TempFolder folder_;
  SyntheticOptions options_;
};

template <ReplayMode kMode, bool kWithColor>
std::unique_ptr<CameraUnderTest> replay() {
  return std::make_unique<ReplayUnderTest>(kMode, kWithColor);
}

/// The same driver out of a plug-in, through the registry.
class PluginUnderTest final : public CameraUnderTest {
 public:
  PluginUnderTest() { write_small_recording(folder_ / "r", 7, false); }
  [[nodiscard]] std::unique_ptr<Camera> make(const Clock& clock) override {
    const std::string options = "driver = \"test\"\nloop = true\nplugins = \"" GRAPNEL_BINARY_DIR
                                "/tests/plugins\"\npath = \"" +
                                (folder_ / "r").string() + "\"\n";
    return make_camera(parse_config(options, "grapnel.toml"), clock);
  }
  [[nodiscard]] CameraInfo declared() const override { return declared_replay(false); }

 private:
  TempFolder folder_;
};

std::unique_ptr<CameraUnderTest> plugin() { return std::make_unique<PluginUnderTest>(); }

template <SyntheticPace kMode>
std::unique_ptr<CameraUnderTest> synthetic() {
  return std::make_unique<SyntheticUnderTest>(kMode);
}

std::string name_of_case(const testing::TestParamInfo<CameraCase>& tested) {
  return tested.param.name;
}

INSTANTIATE_TEST_SUITE_P(
    Drivers, CameraContract,
    testing::Values(CameraCase{"ReplayTrueTime", &replay<ReplayMode::TrueTime, true>},
                    CameraCase{"ReplayFast", &replay<ReplayMode::Fast, false>},
                    CameraCase{"Plugin", &plugin},
                    CameraCase{"SyntheticTrueTime", &synthetic<SyntheticPace::TrueTime>},
                    CameraCase{"SyntheticFast", &synthetic<SyntheticPace::Fast>}),
    name_of_case);

INSTANTIATE_TEST_SUITE_P(
    Drivers, CameraLossContract,
    testing::Values(CameraCase{"SyntheticTrueTime", &synthetic<SyntheticPace::TrueTime>},
                    CameraCase{"SyntheticFast", &synthetic<SyntheticPace::Fast>}),
    name_of_case);

}  // namespace
}  // namespace grapnel::test
