#include "drivers/synthetic/render_ahead.h"

#include <algorithm>

namespace grapnel {
namespace {

constexpr std::int64_t kWait_us = 50'000;

}  // namespace

RenderAhead::RenderAhead(const Scene& scene) : scene_(scene), renderer_(scene) {
  const std::size_t pixels =
      static_cast<std::size_t>(scene.camera.width) * static_cast<std::size_t>(scene.camera.height);
  before_.assign(pixels, 0);
  for (RenderedFrame& cell : cells_) {
    cell.depth.assign(pixels, 0);
    if (scene.camera.color) cell.color.assign(pixels, Rgb8{});
  }
}

void RenderAhead::start(std::uint64_t first_n, std::uint64_t end_n, Signal& changed) {
  stop();
  changed_ = &changed;
  made_.store(0);
  taken_.store(0);
  stop_.store(false);
  thread_ = std::thread([this, first_n, end_n] { run(first_n, end_n); });
}

void RenderAhead::stop() noexcept {
  if (!thread_.joinable()) return;
  stop_.store(true);
  room_.notify();
  thread_.join();
}

const RenderedFrame* RenderAhead::front() const noexcept {
  const std::uint64_t taken = taken_.load(std::memory_order_relaxed);
  if (made_.load(std::memory_order_acquire) == taken) return nullptr;
  return &cells_[taken % kAhead];
}

void RenderAhead::pop() noexcept {
  taken_.fetch_add(1, std::memory_order_release);
  room_.notify();
}

void RenderAhead::run(std::uint64_t first_n, std::uint64_t end_n) {
  std::uint64_t n = first_n;
  bool ended = false;
  while (!stop_.load() && !ended) {
    const std::uint32_t seen = room_.version();
    const std::uint64_t made = made_.load(std::memory_order_relaxed);
    if (made - taken_.load(std::memory_order_acquire) == kAhead) {
      room_.wait(seen, kWait_us);
      continue;
    }
    RenderedFrame& cell = cells_[made % kAhead];
    cell.n = n;
    cell.end = n == end_n;
    ended = cell.end;
    if (!ended) render(cell);
    ++n;
    made_.store(made + 1, std::memory_order_release);
    changed_->notify();
  }
}

void RenderAhead::render(RenderedFrame& cell) {
  cell.faults = faults_at(scene_.faults, static_cast<std::int64_t>(cell.n));
  if (cell.faults.missing) return;
  const int width = scene_.camera.width;
  const int height = scene_.camera.height;
  ImageView<Rgb8> color;
  if (!cell.color.empty()) color = {cell.color.data(), width, height};
  const auto frame = static_cast<std::int64_t>(cell.n % static_cast<std::uint64_t>(scene_.frames));
  renderer_.render(frame, {cell.depth.data(), width, height}, color);
  const auto half = static_cast<std::ptrdiff_t>(cell.depth.size() / 2);
  if (cell.faults.all_zero) std::fill(cell.depth.begin(), cell.depth.end(), std::uint16_t{0});
  if (cell.faults.torn) {
    // The lower half of the frame before takes this one's place, and the other way round for the
    // frame after, which may be torn too.
    std::swap_ranges(before_.begin() + half, before_.end(), cell.depth.begin() + half);
    std::copy(cell.depth.begin(), cell.depth.begin() + half, before_.begin());
  } else {
    std::copy(cell.depth.begin(), cell.depth.end(), before_.begin());
  }
}

}  // namespace grapnel
