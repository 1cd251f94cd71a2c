// The genuine OpenNI 2 with a driver of our own, held to the camera contract.
#include <cmath>

#include "base/config.h"
#include "drivers/registry.h"
#include "tests/contract/camera_contract.h"
#include "tests/support/fake_openni/sensor_file.h"

namespace grapnel::test {
namespace {

class OpenNiUnderTest final : public CameraUnderTest {
 public:
  explicit OpenNiUnderTest(bool color) : color_(color) { plug_in(fake_sensor()); }
  [[nodiscard]] std::unique_ptr<Camera> make(const Clock& clock) override {
    const std::string options = "driver = \"openni2\"\nplugins = \"" GRAPNEL_BINARY_DIR
                                "/bin/cameras\"\ncolor = " +
                                std::string(color_ ? "true" : "false") + "\n";
    return make_camera(parse_config(options, "grapnel.toml"), clock);
  }
  [[nodiscard]] CameraInfo declared() const override {
    CameraInfo info;
    info.driver = "openni2";
    info.serial = fake_sensor().serial;
    // A pinhole whose image spans the field of view.
    info.intrinsics = {kSensorWidth,
                       kSensorHeight,
                       0.5 * kSensorWidth / std::tan(0.5 * double{kSensorHorizontalFov_rad}),
                       0.5 * kSensorHeight / std::tan(0.5 * double{kSensorVerticalFov_rad}),
                       0.5 * kSensorWidth,
                       0.5 * kSensorHeight};
    info.has_color = color_;
    return info;
  }
  void lose_device(Camera&) override { fake_sensor().plugged = 0; }
  void return_device(Camera&) override { plug_in(fake_sensor()); }

 private:
  bool color_;
};

template <bool kColor>
std::unique_ptr<CameraUnderTest> openni() {
  return std::make_unique<OpenNiUnderTest>(kColor);
}

std::string name_of_case(const testing::TestParamInfo<CameraCase>& tested) {
  return tested.param.name;
}

const auto kCases = testing::Values(CameraCase{"OpenNi", &openni<true>},
                                    CameraCase{"OpenNiWithoutColor", &openni<false>});

INSTANTIATE_TEST_SUITE_P(Drivers, CameraContract, kCases, name_of_case);
INSTANTIATE_TEST_SUITE_P(Drivers, CameraLossContract, kCases, name_of_case);

}  // namespace
}  // namespace grapnel::test
