#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>

#include "base/assert.h"

namespace grapnel {

/// Fixed memory in two passes. A measuring arena (default-constructed) hands out empty spans and
/// adds up; a carving arena hands out pieces of one block, 64-byte aligned, zeroed by its owner.
/// The same `reserve(Arena&, …)` functions run over both, so the measured sum is what is used.
class Arena {
 public:
  static constexpr std::size_t kAlignment = 64;

  /// Measures only.
  Arena() = default;
  /// Carves `block`, whose data must be 64-byte aligned.
  explicit Arena(std::span<std::byte> block) : block_(block), carving_(true) {
    GRAPNEL_ASSERT(reinterpret_cast<std::uintptr_t>(block.data()) % kAlignment == 0);
  }

  /// Room for `count` elements, default-initialised; an empty span while measuring. Running out
  /// while carving is a program error: the block is sized by the measuring pass.
  template <class T>
  [[nodiscard]] std::span<T> take(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T>);
    static_assert(alignof(T) <= kAlignment);
    const std::size_t offset = used_;
    used_ += round_up(count * sizeof(T));
    if (!carving_) return {};
    GRAPNEL_ASSERT(used_ <= block_.size());
    T* first = reinterpret_cast<T*>(block_.data() + offset);
    for (std::size_t i = 0; i < count; ++i) ::new (static_cast<void*>(first + i)) T{};
    return {first, count};
  }

  [[nodiscard]] bool measuring() const noexcept { return !carving_; }
  /// Bytes taken so far, padding included.
  [[nodiscard]] std::size_t used_bytes() const noexcept { return used_; }

 private:
  static constexpr std::size_t round_up(std::size_t bytes) noexcept {
    return (bytes + kAlignment - 1) / kAlignment * kAlignment;
  }

  std::span<std::byte> block_;
  std::size_t used_ = 0;
  bool carving_ = false;
};

}  // namespace grapnel
