#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "base/image.h"
#include "base/signal.h"
#include "drivers/replay/playback_order.h"
#include "drivers/replay/recording.h"

namespace grapnel {

/// What the decoder hands over for one place in the order of play.
struct DecodedFrame {
  enum class Kind : std::uint8_t {
    Frame,
    Bad,     ///< could not be read and is to be dropped
    End,     ///< nothing follows
    Failed,  ///< could not be read, and nothing follows
  };
  Kind kind = Kind::End;
  bool has_color = false;
  std::uint64_t n = 0;        ///< place in the order of play
  std::uint64_t skipped = 0;  ///< places left out before it, being too late
  std::vector<std::uint16_t> depth;
  std::vector<Rgb8> color;
};

/// Decodes the frames to come on a thread of its own, a few ahead, since libpng and libjpeg
/// allocate. One reader takes them in order, without a heap call.
class DecodeAhead {
 public:
  static constexpr std::size_t kAhead = 4;

  /// Takes the memory for kAhead frames. `recording` and `order` outlive it.
  DecodeAhead(const Recording& recording, const PlaybackOrder& order);
  ~DecodeAhead() { stop(); }
  DecodeAhead(const DecodeAhead&) = delete;
  DecodeAhead& operator=(const DecodeAhead&) = delete;

  /// Called on the decoder's thread.
  struct Callbacks {
    std::function<bool(std::uint64_t n)> too_late;       ///< place n need not be decoded any more
    std::function<void(const std::string&)> on_problem;  ///< before the Bad or Failed is ready
  };
  /// `changed` is notified at every frame that becomes ready.
  void start(OnBadFrame on_bad_frame, Callbacks callbacks, Signal& changed);
  void stop() noexcept;

  /// Reader: the next one, nullptr while it is not ready.
  [[nodiscard]] const DecodedFrame* front() const noexcept;
  void pop() noexcept;

 private:
  void run();
  /// False after the last one.
  bool decode_next(DecodedFrame& cell);
  void decode(DecodedFrame& cell);

  const Recording& recording_;
  const PlaybackOrder& order_;
  OnBadFrame on_bad_frame_ = OnBadFrame::Error;
  Callbacks callbacks_;
  Signal* changed_ = nullptr;
  std::array<DecodedFrame, kAhead> cells_;
  std::atomic<std::uint64_t> made_{0};
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<bool> stop_{false};
  Signal room_;
  std::uint64_t next_n_ = 0;
  std::size_t bad_in_a_row_ = 0;
  std::thread thread_;
};

}  // namespace grapnel
