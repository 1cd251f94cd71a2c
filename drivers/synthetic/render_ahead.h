#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "base/image.h"
#include "base/signal.h"
#include "drivers/synthetic/fault_script.h"
#include "drivers/synthetic/scene.h"
#include "drivers/synthetic/scene_renderer.h"

namespace grapnel {

/// One frame time of the simulated sensor.
struct RenderedFrame {
  std::uint64_t n = 0;  ///< frame times since the camera was opened
  bool end = false;     ///< nothing follows; holds no image
  FrameFaults faults;   ///< holds no image when the frame is missing
  std::vector<std::uint16_t> depth;
  std::vector<Rgb8> color;  ///< empty without colour
};

/// Renders the frames to come on a thread of its own, a few ahead. One reader takes them in order,
/// without a heap call.
class RenderAhead {
 public:
  static constexpr std::size_t kAhead = 4;

  /// Takes the memory for kAhead frames. `scene` outlives it.
  explicit RenderAhead(const Scene& scene);
  ~RenderAhead() { stop(); }
  RenderAhead(const RenderAhead&) = delete;
  RenderAhead& operator=(const RenderAhead&) = delete;

  /// Begins with frame time `first_n`, ends before `end_n`. `changed` is notified at every frame
  /// that becomes ready. Throws std::system_error when there is no thread to be had.
  void start(std::uint64_t first_n, std::uint64_t end_n, Signal& changed);
  void stop() noexcept;

  /// Reader: the next one, nullptr while it is not ready.
  [[nodiscard]] const RenderedFrame* front() const noexcept;
  void pop() noexcept;

 private:
  void run(std::uint64_t first_n, std::uint64_t end_n);
  void render(RenderedFrame& cell);

  const Scene& scene_;
  SceneRenderer renderer_;
  Signal* changed_ = nullptr;
  std::array<RenderedFrame, kAhead> cells_;
  std::vector<std::uint16_t> before_;  // depth of the frame time before
  std::atomic<std::uint64_t> made_{0};
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<bool> stop_{false};
  Signal room_;
  std::thread thread_;
};

}  // namespace grapnel
