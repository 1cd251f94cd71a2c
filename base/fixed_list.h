#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>

#include "base/assert.h"

namespace grapnel {

/// A list over memory it does not own, with a fixed capacity. A full list refuses and remembers
/// that it did: never an unsaid cut.
template <class T>
class FixedList {
 public:
  FixedList() = default;
  explicit FixedList(std::span<T> storage) : storage_(storage) {}

  /// False when full; `overflowed()` then stays true until `clear()`.
  bool push_back(const T& value) noexcept {
    if (size_ == storage_.size()) {
      overflowed_ = true;
      return false;
    }
    storage_[size_++] = value;
    return true;
  }
  void clear() noexcept {
    size_ = 0;
    overflowed_ = false;
  }
  /// Shortens or lengthens within the capacity; new elements hold what the storage holds.
  void resize(std::size_t size) noexcept {
    GRAPNEL_ASSERT(size <= storage_.size());
    size_ = size;
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] std::size_t capacity() const noexcept { return storage_.size(); }
  [[nodiscard]] bool full() const noexcept { return size_ == storage_.size(); }
  [[nodiscard]] bool overflowed() const noexcept { return overflowed_; }
  void mark_overflowed() noexcept { overflowed_ = true; }

  T& operator[](std::size_t i) noexcept { return storage_[i]; }
  const T& operator[](std::size_t i) const noexcept { return storage_[i]; }
  [[nodiscard]] T* begin() noexcept { return storage_.data(); }
  [[nodiscard]] T* end() noexcept { return storage_.data() + size_; }
  [[nodiscard]] const T* begin() const noexcept { return storage_.data(); }
  [[nodiscard]] const T* end() const noexcept { return storage_.data() + size_; }
  [[nodiscard]] std::span<T> span() noexcept { return storage_.first(size_); }
  [[nodiscard]] std::span<const T> span() const noexcept { return storage_.first(size_); }

 private:
  std::span<T> storage_;
  std::size_t size_ = 0;
  bool overflowed_ = false;
};

/// A FixedList with its storage inside; copies its elements.
template <class T, std::size_t kCapacity>
class InlineList {
 public:
  InlineList() = default;
  InlineList(std::initializer_list<T> values) {
    for (const T& value : values) push_back(value);
  }

  bool push_back(const T& value) noexcept {
    if (size_ == kCapacity) {
      overflowed_ = true;
      return false;
    }
    storage_[size_++] = value;
    return true;
  }
  void clear() noexcept {
    size_ = 0;
    overflowed_ = false;
  }
  void resize(std::size_t size) noexcept {
    GRAPNEL_ASSERT(size <= kCapacity);
    size_ = size;
  }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return kCapacity; }
  [[nodiscard]] bool full() const noexcept { return size_ == kCapacity; }
  [[nodiscard]] bool overflowed() const noexcept { return overflowed_; }
  void mark_overflowed() noexcept { overflowed_ = true; }

  T& operator[](std::size_t i) noexcept { return storage_[i]; }
  const T& operator[](std::size_t i) const noexcept { return storage_[i]; }
  [[nodiscard]] T* begin() noexcept { return storage_; }
  [[nodiscard]] T* end() noexcept { return storage_ + size_; }
  [[nodiscard]] const T* begin() const noexcept { return storage_; }
  [[nodiscard]] const T* end() const noexcept { return storage_ + size_; }
  [[nodiscard]] std::span<const T> span() const noexcept { return {storage_, size_}; }

 private:
  T storage_[kCapacity]{};
  std::size_t size_ = 0;
  bool overflowed_ = false;
};

}  // namespace grapnel
