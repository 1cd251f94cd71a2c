#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/depth_frame.h"
#include "base/signal.h"

namespace grapnel {

class FramePool;
class FrameFilter;

/// The right to read one frame. While it lives the capture thread does not reuse the slot.
class FrameLease {
 public:
  FrameLease() = default;
  FrameLease(FrameLease&& other) noexcept;
  FrameLease& operator=(FrameLease&& other) noexcept;
  FrameLease(const FrameLease&) = delete;
  FrameLease& operator=(const FrameLease&) = delete;
  ~FrameLease() { release(); }

  [[nodiscard]] bool valid() const noexcept { return pool_ != nullptr; }
  /// Precondition: valid().
  [[nodiscard]] const DepthFrame& frame() const noexcept;
  void release() noexcept;

 private:
  friend class FramePool;
  FrameLease(FramePool* pool, std::size_t slot) noexcept : pool_(pool), slot_(slot) {}

  FramePool* pool_ = nullptr;
  std::size_t slot_ = 0;
};

/// Fixed set of frame slots between one capture thread and any readers, without locks. The writer
/// takes the oldest slot that nobody leases; the last published frames stay readable as history.
/// All memory is taken in the constructor.
class FramePool {
 public:
  /// What the writer fills. `frame` describes it; the pixel pointers are the writable halves of its
  /// views.
  struct Slot {
    DepthFrame frame;
    std::uint16_t* depth = nullptr;  ///< capacity max_width × max_height, rows packed
    Rgb8* color = nullptr;           ///< the same, nullptr in a pool without colour
  };

  FramePool(std::size_t slots, int max_width, int max_height, bool with_color);
  FramePool(const FramePool&) = delete;
  FramePool& operator=(const FramePool&) = delete;
  ~FramePool();

  /// Writer: a slot to fill, nullptr when every slot is leased (the frame is then lost:
  /// count_drop()). At most one slot is out at a time.
  [[nodiscard]] Slot* begin_write() noexcept;
  /// What changes every frame from now on before it is published; nullptr: nothing. While no
  /// capture thread runs.
  void set_filter(FrameFilter* filter) noexcept { filter_ = filter; }
  /// Writer: makes the slot the newest frame. `slot->frame.depth` must view `slot->depth`, and so
  /// on.
  void publish(Slot* slot) noexcept;
  /// Writer: gives the slot back unpublished.
  void discard(Slot* slot) noexcept;
  /// Writer: a frame of the sensor that never became a slot.
  void count_drop(std::uint64_t frames = 1) noexcept {
    dropped_.fetch_add(frames, std::memory_order_relaxed);
  }

  /// The newest frame; invalid before the first one.
  [[nodiscard]] FrameLease lease_latest() noexcept;
  /// The oldest held frame with exposure_us >= `not_before_us`; invalid when there is none yet.
  [[nodiscard]] FrameLease lease_first_since(std::int64_t not_before_us) noexcept;
  /// The held frame whose exposure_us is nearest to `time_us`.
  [[nodiscard]] FrameLease lease_nearest(std::int64_t time_us) noexcept;

  /// Notified at every publish and by wake().
  [[nodiscard]] const Signal& published_signal() const noexcept { return signal_; }
  void wake() noexcept { signal_.notify(); }

  /// Forgets every published frame that is not leased (after the camera went away).
  void invalidate() noexcept;

  [[nodiscard]] std::uint64_t published() const noexcept {
    return published_.load(std::memory_order_acquire);
  }
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return dropped_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] int max_width() const noexcept { return max_width_; }
  [[nodiscard]] int max_height() const noexcept { return max_height_; }
  [[nodiscard]] bool with_color() const noexcept { return with_color_; }
  /// Bytes taken by the constructor.
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  friend class FrameLease;
  struct Cell;

  template <class Better>
  [[nodiscard]] FrameLease lease_best(Better better) noexcept;
  void release(std::size_t slot) noexcept;

  FrameFilter* filter_ = nullptr;
  int max_width_;
  int max_height_;
  bool with_color_;
  std::size_t bytes_ = 0;
  std::size_t count_;
  std::unique_ptr<Cell[]> cells_;
  std::vector<std::uint16_t> depth_;
  std::vector<Rgb8> color_;
  std::uint64_t order_ = 0;  // writer only
  std::atomic<std::uint64_t> published_{0};
  std::atomic<std::uint64_t> dropped_{0};
  Signal signal_;
};

/// Changes frames on the capture thread before anybody sees them. Neither allocates nor waits.
class FrameFilter {
 public:
  virtual ~FrameFilter() = default;
  virtual void apply(FramePool::Slot& slot) noexcept = 0;
};

}  // namespace grapnel
