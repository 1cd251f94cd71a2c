#include "tests/support/heap_guard.h"

#include <execinfo.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

namespace grapnel::test {
namespace {

struct ThreadCount {
  std::uint64_t calls = 0;
  bool armed = false;
};

constinit thread_local ThreadCount t_count;

std::array<void*, 32> g_stack;
std::atomic<int> g_stack_depth{0};

std::atomic<std::uint64_t> g_calls{0};

void count_call() noexcept {
  g_calls.fetch_add(1, std::memory_order_relaxed);
  if (!t_count.armed) return;
  t_count.armed = false;
  ++t_count.calls;
  int none = 0;
  if (g_stack_depth.compare_exchange_strong(none, -1)) {
    g_stack_depth.store(backtrace(g_stack.data(), static_cast<int>(g_stack.size())));
  }
  t_count.armed = true;
}

}  // namespace

bool heap_guard_works() noexcept { return true; }

void arm_heap_guard() noexcept {
  // The first backtrace() of a program loads a library, which allocates.
  std::array<void*, 2> warm_up;
  backtrace(warm_up.data(), static_cast<int>(warm_up.size()));
  t_count = {0, true};
}

void disarm_heap_guard() noexcept { t_count.armed = false; }

std::uint64_t heap_calls() noexcept { return t_count.calls; }

std::uint64_t heap_calls_of_all() noexcept { return g_calls.load(std::memory_order_relaxed); }

std::string first_heap_call() {
  const int depth = g_stack_depth.load();
  std::string text;
  if (depth <= 0) return text;
  char** const names = backtrace_symbols(g_stack.data(), depth);
  for (int i = 0; names != nullptr && i < depth; ++i) {
    text += names[i];
    text += '\n';
  }
  std::free(static_cast<void*>(names));
  return text;
}

void clear_first_heap_call() noexcept { g_stack_depth.store(0); }

}  // namespace grapnel::test

extern "C" {

void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* block, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);
void __libc_free(void* block);

void* malloc(std::size_t bytes) noexcept {
  grapnel::test::count_call();
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) noexcept {
  grapnel::test::count_call();
  return __libc_calloc(count, bytes);
}
void* realloc(void* block, std::size_t bytes) noexcept {
  grapnel::test::count_call();
  return __libc_realloc(block, bytes);
}
void free(void* block) noexcept {
  grapnel::test::count_call();
  __libc_free(block);
}
void* memalign(std::size_t alignment, std::size_t bytes) noexcept {
  grapnel::test::count_call();
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  grapnel::test::count_call();
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) noexcept {
  grapnel::test::count_call();
  void* const made = __libc_memalign(alignment, bytes);
  if (made == nullptr) return ENOMEM;
  *block = made;
  return 0;
}
}
