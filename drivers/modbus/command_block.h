#pragma once

#include <cstdint>

#include "drivers/modbus/register_image.h"
#include "hal/plc.h"

namespace grapnel {

/// Names a peer while it is connected; kNoPeer is nobody.
using PeerId = std::uint16_t;
inline constexpr PeerId kNoPeer = 0;

/// The command block's meaning: who may write it, when a token executes, and whether the PLC's
/// heartbeat lives. One thread.
class CommandBlock {
 public:
  /// `image` and `sink` must outlive it.
  CommandBlock(RegisterImage& image, PlcCommandSink& sink) noexcept
      : image_(&image), sink_(&sink) {}

  /// Nobody owns the block, or `peer` does.
  [[nodiscard]] bool may_take(PeerId peer) const noexcept {
    return owner_ == kNoPeer || owner_ == peer;
  }
  void take(PeerId peer) noexcept { owner_ = peer; }
  /// Tells the sink when `peer` was the owner.
  void release(PeerId peer) noexcept;
  [[nodiscard]] PeerId owner() const noexcept { return owner_; }

  /// Looks at the registers after a write: runs a new token, notes the heartbeat, and the live
  /// encoder count when `encoder_alone` says that its two words, and no other, came. True when the
  /// device's counters are to be cleared (command 82 accepted).
  bool after_write(std::int64_t now_us, bool encoder_alone) noexcept;
  /// Looks at the heartbeat's limit; at least every 100 ms.
  void supervise(std::int64_t now_us) noexcept;
  [[nodiscard]] bool heartbeat_lost() const noexcept { return heartbeat_lost_; }
  /// When supervise() has to look next; INT64_MAX when the heartbeat is not supervised or lost.
  [[nodiscard]] std::int64_t heartbeat_deadline_us() const noexcept;

  /// ACK_SEQ to show: 0 while CMD_SEQ is 0, else the sink's.
  [[nodiscard]] std::uint16_t acknowledged(std::uint16_t sink_ack_seq) const noexcept {
    return last_seq_ == 0 ? std::uint16_t{0} : sink_ack_seq;
  }

 private:
  bool run_command(std::int64_t now_us) noexcept;
  void note_heartbeat(std::int64_t now_us) noexcept;

  RegisterImage* image_;
  PlcCommandSink* sink_;
  PeerId owner_ = kNoPeer;
  std::uint16_t last_seq_ = 0;
  std::uint16_t last_beat_ = 0;
  std::int64_t limit_us_ = 0;  // 0: not supervised
  std::int64_t last_beat_us_ = 0;
  bool heartbeat_lost_ = false;
};

}  // namespace grapnel
