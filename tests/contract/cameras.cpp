// The drivers that the camera contract suite runs on: a new one is a class and a line below.
#include "drivers/replay/replay_camera.h"
#include "tests/contract/camera_contract.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel::test {
namespace {

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
  [[nodiscard]] CameraInfo declared() const override {
    const CameraFile camera = small_camera();
    CameraInfo info;
    info.driver = "replay";
    info.serial = camera.serial;
    info.intrinsics = camera.intrinsics();
    info.metres_per_unit = camera.metres_per_unit;
    info.baseline_m = camera.baseline_m;
    info.has_color = with_color_;
    info.live = false;
    return info;
  }

 private:
  TempFolder folder_;
  ReplayOptions options_;
  bool with_color_;
};

template <ReplayMode kMode, bool kWithColor>
std::unique_ptr<CameraUnderTest> replay() {
  return std::make_unique<ReplayUnderTest>(kMode, kWithColor);
}

std::string name_of_case(const testing::TestParamInfo<CameraCase>& tested) {
  return tested.param.name;
}

INSTANTIATE_TEST_SUITE_P(
    Drivers, CameraContract,
    testing::Values(CameraCase{"ReplayTrueTime", &replay<ReplayMode::TrueTime, true>},
                    CameraCase{"ReplayFast", &replay<ReplayMode::Fast, false>}),
    name_of_case);

}  // namespace
}  // namespace grapnel::test
