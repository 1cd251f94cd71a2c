#include "drivers/replay/decode_ahead.h"

#include <exception>
#include <utility>

namespace grapnel {
namespace {

constexpr std::int64_t kRoomPoll_us = 100'000;

}  // namespace

DecodeAhead::DecodeAhead(const Recording& recording, const PlaybackOrder& order)
    : recording_(recording), order_(order) {
  const auto pixels = static_cast<std::size_t>(recording.camera().width) *
                      static_cast<std::size_t>(recording.camera().height);
  for (DecodedFrame& cell : cells_) {
    cell.depth.resize(pixels);
    if (recording.has_color()) cell.color.resize(pixels);
  }
}

void DecodeAhead::start(OnBadFrame on_bad_frame, Callbacks callbacks, Signal& changed) {
  stop();
  on_bad_frame_ = on_bad_frame;
  callbacks_ = std::move(callbacks);
  changed_ = &changed;
  made_.store(0, std::memory_order_relaxed);
  taken_.store(0, std::memory_order_relaxed);
  stop_.store(false, std::memory_order_relaxed);
  next_n_ = 0;
  bad_in_a_row_ = 0;
  thread_ = std::thread([this] { run(); });
}

void DecodeAhead::stop() noexcept {
  if (!thread_.joinable()) return;
  stop_.store(true, std::memory_order_release);
  room_.notify();
  thread_.join();
}

const DecodedFrame* DecodeAhead::front() const noexcept {
  const std::uint64_t taken = taken_.load(std::memory_order_relaxed);
  if (made_.load(std::memory_order_acquire) == taken) return nullptr;
  return &cells_[taken % kAhead];
}

void DecodeAhead::pop() noexcept {
  taken_.fetch_add(1, std::memory_order_release);
  room_.notify();
}

void DecodeAhead::run() {
  bool more = true;
  while (more && !stop_.load(std::memory_order_acquire)) {
    const std::uint32_t seen = room_.version();
    const std::uint64_t made = made_.load(std::memory_order_relaxed);
    if (made - taken_.load(std::memory_order_acquire) == kAhead) {
      room_.wait(seen, kRoomPoll_us);
      continue;
    }
    more = decode_next(cells_[made % kAhead]);
    made_.store(made + 1, std::memory_order_release);
    changed_->notify();
  }
}

bool DecodeAhead::decode_next(DecodedFrame& cell) {
  cell.skipped = 0;
  while (order_.has(next_n_) && callbacks_.too_late(next_n_) &&
         !stop_.load(std::memory_order_relaxed)) {
    ++cell.skipped;
    ++next_n_;
  }
  cell.n = next_n_;
  if (!order_.has(next_n_)) {
    cell.kind = DecodedFrame::Kind::End;
    return false;
  }
  ++next_n_;
  decode(cell);
  return cell.kind != DecodedFrame::Kind::Failed;
}

void DecodeAhead::decode(DecodedFrame& cell) {
  try {
    cell.has_color = recording_.read_frame(order_.frame(cell.n), cell.depth, cell.color);
    cell.kind = DecodedFrame::Kind::Frame;
    bad_in_a_row_ = 0;
  } catch (const std::exception& error) {
    // A loop in which no frame is readable would spin for ever.
    const bool give_up =
        on_bad_frame_ == OnBadFrame::Error || ++bad_in_a_row_ >= order_.lap_frames();
    cell.kind = give_up ? DecodedFrame::Kind::Failed : DecodedFrame::Kind::Bad;
    callbacks_.on_problem(error.what());
  }
}

}  // namespace grapnel
