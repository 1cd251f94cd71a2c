#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "base/arena.h"
#include "base/depth_frame.h"
#include "base/error.h"
#include "firmware_app/belt_check.h"
#include "pipeline/registrar.h"

namespace grapnel {

/// The belt as taught: median depth and the plane through it. Learned on the registration thread
/// (command 60), saved by housekeeping, loaded at start. Two images, so that the one in use stays
/// whole while the next is learned.
class Background {
 public:
  static constexpr int kMaxFrames = 15;

  /// Memory for images of up to max_width × max_height and `frames` frames to learn from.
  void reserve(Arena& arena, int max_width, int max_height, int frames);
  /// Fixes the plane (n·p + offset = 0, n toward the camera) instead of fitting it.
  void set_plane(const Vec3d& normal, double offset_m) noexcept;

  /// What jobs on frames of this shape may use; empty when nothing fitting was taught.
  [[nodiscard]] BeltBackground view(const DepthFrame& frame) const noexcept;

  /// Registration thread. Starts learning; false while the last image is still being saved.
  [[nodiscard]] bool begin() noexcept;
  /// One more frame; SensorMoved when its shape differs from the first one's.
  Status add(const DepthFrame& frame) noexcept;
  /// Takes the median, fits the plane and puts both in use. DepthMostlyInvalid when under half of
  /// the pixels have a reading in most frames.
  Status finish() noexcept;

  /// Housekeeping. Writes the image learned last, once, and answers true; does nothing when there
  /// is none. Throws InputError.
  bool save_if_learned(const std::filesystem::path& file);
  /// Housekeeping: where jobs expect the belt, as set, loaded or saved last.
  [[nodiscard]] const BeltPlane& reference() const noexcept { return reference_; }
  /// At start. False when there is no file; throws InputError when it is damaged or does not fit.
  bool load(const std::filesystem::path& file);

 private:
  struct Image {
    std::span<std::uint16_t> depth;
    int width = 0;
    int height = 0;
    double metres_per_unit = 0.0;
    Intrinsics intrinsics;
    bool has_plane = false;
    Vec3d plane_normal = Vec3d::Zero();
    double plane_offset_m = 0.0;
  };

  void fit_plane(Image& image) noexcept;
  void take_reference(const Image& image) noexcept;
  [[nodiscard]] std::vector<std::byte> encode(const Image& image) const;

  std::array<Image, 2> images_;
  std::size_t in_use_ = 0;  // registration thread, and before it starts
  std::array<std::span<std::uint16_t>, kMaxFrames> frames_;
  int frames_wanted_ = 0;
  int learned_ = 0;
  bool fixed_plane_ = false;
  Vec3d fixed_normal_ = Vec3d::Zero();
  double fixed_offset_m_ = 0.0;
  std::atomic<int> to_save_{-1};
  BeltPlane reference_;
};

}  // namespace grapnel
