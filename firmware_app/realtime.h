#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include <pthread.h>

namespace grapnel {

/// Makes the heap keep what it has (no trim, no mapping of large blocks), so that a freed and taken
/// again block does not fault.
void tune_heap() noexcept;

/// Locks present and future memory. False when the kernel refuses; `why` says how to grant it.
[[nodiscard]] bool lock_memory(std::string& why);

/// How a thread is scheduled. Priority 0 = normal, cpu -1 = any.
struct Scheduling {
  int priority = 0;
  int cpu = -1;
};

/// Applies to the calling thread. False when the kernel refuses; the thread then stays normal.
bool schedule_this_thread(const Scheduling& scheduling) noexcept;

/// Names the calling thread (15 characters) for top and the crash record.
void name_this_thread(const char* name) noexcept;

/// Touches this much of the calling thread's stack, so that it does not fault later.
void touch_stack() noexcept;

/// A thread with a small stack of its own.
class Thread {
 public:
  /// Enough for every stage; the pipeline's buffers are not on the stack.
  static constexpr std::size_t kStackBytes = std::size_t{1} << 20;
  using Body = void (*)(void* context);

  Thread() = default;
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  ~Thread() { join(); }
  /// False when the kernel has no thread to give. `context` outlives the thread.
  [[nodiscard]] bool start(Body body, void* context);
  void join() noexcept;

 private:
  struct Start {
    Body body;
    void* context;
  };
  std::unique_ptr<Start> start_;
  pthread_t thread_{};
  bool running_ = false;
};

/// One block of anonymous memory, 64-byte aligned, zeroed, every page touched.
class MemoryBlock {
 public:
  MemoryBlock() = default;
  /// Throws InputError when there is not that much.
  explicit MemoryBlock(std::size_t bytes);
  MemoryBlock(const MemoryBlock&) = delete;
  MemoryBlock& operator=(const MemoryBlock&) = delete;
  ~MemoryBlock();
  [[nodiscard]] std::span<std::byte> span() const noexcept { return {data_, bytes_}; }

 private:
  std::byte* data_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace grapnel
