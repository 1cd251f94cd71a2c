// Linked into grapneld itself: every heap call of the process passes here, and those of an attached
// thread are counted. The sanitizers bring an interposer of their own, so it is left out there.
#include <atomic>
#include <cerrno>
#include <cstddef>

#include "firmware_app/thread_account.h"

extern "C" {

void* __libc_malloc(std::size_t bytes);
void __libc_free(void* block);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* block, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);
}

namespace {

void count() noexcept {
  if (grapnel::t_heap_calls != nullptr) {
    grapnel::t_heap_calls->fetch_add(1, std::memory_order_relaxed);
  }
}

struct Announce {
  Announce() noexcept { grapnel::g_heap_interposed.store(true); }
};
const Announce kAnnounce;

}  // namespace

extern "C" {

void* malloc(std::size_t bytes) {
  count();
  return __libc_malloc(bytes);
}

void free(void* block) {
  if (block != nullptr) count();
  __libc_free(block);
}

void* calloc(std::size_t number, std::size_t bytes) {
  count();
  return __libc_calloc(number, bytes);
}

void* realloc(void* block, std::size_t bytes) {
  count();
  return __libc_realloc(block, bytes);
}

void* memalign(std::size_t alignment, std::size_t bytes) {
  count();
  return __libc_memalign(alignment, bytes);
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  count();
  return __libc_memalign(alignment, bytes);
}

int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) {
  count();
  *block = __libc_memalign(alignment, bytes);
  return *block != nullptr ? 0 : ENOMEM;
}
}
