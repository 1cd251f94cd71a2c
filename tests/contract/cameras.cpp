// The drivers that the camera contract suite runs on: a new one is a class and a line below.
#include "drivers/registry.h"
#include "drivers/replay/replay_camera.h"
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

std::string name_of_case(const testing::TestParamInfo<CameraCase>& tested) {
  return tested.param.name;
}

INSTANTIATE_TEST_SUITE_P(Drivers, CameraContract,
                         testing::Values(CameraCase{"ReplayTrueTime",
                                                    &replay<ReplayMode::TrueTime, true>},
                                         CameraCase{"ReplayFast", &replay<ReplayMode::Fast, false>},
                                         CameraCase{"Plugin", &plugin}),
                         name_of_case);

}  // namespace
}  // namespace grapnel::test
