#include "drivers/corrected_camera.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/input_error.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/depth_correction.h"
#include "drivers/replay/undistort.h"

namespace grapnel {
namespace {

/// Its filter works on the capture thread between start() and stop().
class CorrectedCamera final : public Camera, private FrameFilter {
 public:
  CorrectedCamera(std::unique_ptr<Camera> camera, std::filesystem::path calibration)
      : camera_(std::move(camera)), calibration_(std::move(calibration)) {}
  CorrectedCamera(const CorrectedCamera&) = delete;
  CorrectedCamera& operator=(const CorrectedCamera&) = delete;
  ~CorrectedCamera() override { close(); }

  Result<CameraInfo> open() override {
    problem_.clear();
    Result<CameraInfo> info = camera_->open();
    if (!info) return info;
    try {
      take(info.value());
    } catch (const InputError& error) {
      problem_ = error.what();
      camera_->close();
      return Error{Code::WrongSerial, Stage::Capture, 0};
    }
    CameraInfo corrected = info.value();
    if (file_) corrected.intrinsics = file_->intrinsics();
    if (file_) corrected.baseline_m = file_->baseline_m;
    return corrected;
  }
  Status start(FramePool& pool, const CaptureHooks& hooks) override {
    const bool idle = camera_->status().state == CameraState::Opened;
    if (file_ && idle) pool.set_filter(this);
    const Status started = camera_->start(pool, hooks);
    if (started) pool_ = &pool;
    if (!started && idle) pool.set_filter(nullptr);
    return started;
  }
  void stop() noexcept override {
    camera_->stop();
    if (pool_ != nullptr) pool_->set_filter(nullptr);
    pool_ = nullptr;
  }
  void close() noexcept override {
    stop();
    camera_->close();
  }
  [[nodiscard]] CameraStatus status() const noexcept override { return camera_->status(); }
  [[nodiscard]] bool stepped() const noexcept override { return camera_->stepped(); }
  void request_frame() noexcept override { camera_->request_frame(); }
  [[nodiscard]] std::string problem() const override {
    return problem_.empty() ? camera_->problem() : problem_;
  }

 private:
  void take(const CameraInfo& info) {
    file_.reset();
    if (info.corrected) return;
    const bool folder = std::filesystem::is_directory(calibration_);
    const std::filesystem::path file =
        folder ? calibration_ / (info.serial + ".toml") : calibration_;
    if (folder && !std::filesystem::exists(file)) return;
    CameraFile camera = read_camera_file(file);
    if (!camera.serial.empty() && camera.serial != info.serial) {
      throw InputError(file.string() + ": serial: \"" + camera.serial +
                       "\" is not allowed; the camera is \"" + info.serial + "\"");
    }
    if (camera.width != info.intrinsics.width || camera.height != info.intrinsics.height) {
      throw InputError(file.string() + ": " + std::to_string(camera.width) + " by " +
                       std::to_string(camera.height) + " pixels; the camera has " +
                       std::to_string(info.intrinsics.width) + " by " +
                       std::to_string(info.intrinsics.height));
    }
    correction_ = DepthCorrection(camera, info.metres_per_unit);
    scratch_.assign(correction_.scratch_floats(), 0.0F);
    map_ = undistortion_map(camera);
    depth_before_.assign(map_.size(), 0);
    color_before_.assign(info.has_color ? map_.size() : 0, Rgb8{});
    file_ = std::move(camera);
  }

  void apply(FramePool::Slot& slot) noexcept override {
    DepthFrame& frame = slot.frame;
    const std::size_t pixels = frame.depth.pixels();
    if (frame.depth.width != file_->width || frame.depth.height != file_->height) return;
    if (!map_.empty()) {
      undistort<std::uint16_t>(map_, {slot.depth, pixels}, depth_before_);
      if (!frame.color.empty()) undistort<Rgb8>(map_, {slot.color, pixels}, color_before_);
    }
    correction_.apply({slot.depth, pixels}, scratch_);
    frame.intrinsics = file_->intrinsics();
    frame.baseline_m = file_->baseline_m;
    frame.corrected = true;
  }

  std::unique_ptr<Camera> camera_;
  std::filesystem::path calibration_;
  std::optional<CameraFile> file_;
  DepthCorrection correction_;
  std::vector<float> scratch_;
  std::vector<std::uint32_t> map_;
  std::vector<std::uint16_t> depth_before_;
  std::vector<Rgb8> color_before_;
  FramePool* pool_ = nullptr;
  std::string problem_;
};

}  // namespace

std::unique_ptr<Camera> make_corrected_camera(std::unique_ptr<Camera> camera,
                                              std::filesystem::path calibration) {
  return std::make_unique<CorrectedCamera>(std::move(camera), std::move(calibration));
}

}  // namespace grapnel
