// The genuine libfreenect over a simulated USB, held to the camera contract.
#include "base/config.h"
#include "drivers/registry.h"
#include "tests/contract/camera_contract.h"
#include "tests/support/fake_usb/fake_kinect.h"

namespace grapnel::test {
namespace {

class FreenectUnderTest final : public CameraUnderTest {
 public:
  explicit FreenectUnderTest(std::string options) : options_(std::move(options)) {
    FakeKinect& kinect = *grapnel_fake_kinect();
    kinect.plugged.store(1);
  }
  [[nodiscard]] std::unique_ptr<Camera> make(const Clock& clock) override {
    return make_camera(
        parse_config(
            "driver = \"freenect\"\nplugins = \"" GRAPNEL_BINARY_DIR "/bin/cameras\"\n" + options_,
            "grapnel.toml"),
        clock);
  }
  [[nodiscard]] CameraInfo declared() const override {
    // libfreenect_registration.h: the zero plane's distance over its pixel, which is half of ours.
    const double focal_px =
        static_cast<double>(kFakeReference_mm) / (2.0 * static_cast<double>(kFakePixel_mm));
    CameraInfo info;
    info.driver = "freenect";
    info.serial = grapnel_fake_kinect()->serial;
    info.intrinsics = {kFakeWidth, kFakeHeight, focal_px, focal_px, 320.0, 240.0};
    info.metres_per_unit = options_.find("raw") == std::string::npos ? 0.001 : 0.0002;
    info.baseline_m = 0.01 * static_cast<double>(kFakeEmitter_cm);
    info.has_color = options_.find("color = false") == std::string::npos;
    return info;
  }
  void lose_device(Camera&) override { grapnel_fake_kinect()->plugged.store(0); }
  void return_device(Camera&) override {
    ++grapnel_fake_kinect()->address;
    grapnel_fake_kinect()->plugged.store(1);
  }

 private:
  std::string options_;
};

std::unique_ptr<CameraUnderTest> millimetres() {
  return std::make_unique<FreenectUnderTest>("depth = \"mm\"\n");
}
std::unique_ptr<CameraUnderTest> raw_without_color() {
  return std::make_unique<FreenectUnderTest>("depth = \"raw\"\ncolor = false\n");
}

std::string name_of_case(const testing::TestParamInfo<CameraCase>& tested) {
  return tested.param.name;
}

const auto kCases = testing::Values(CameraCase{"FreenectMillimetres", &millimetres},
                                    CameraCase{"FreenectRawWithoutColor", &raw_without_color});

INSTANTIATE_TEST_SUITE_P(Drivers, CameraContract, kCases, name_of_case);
INSTANTIATE_TEST_SUITE_P(Drivers, CameraLossContract, kCases, name_of_case);

}  // namespace
}  // namespace grapnel::test
