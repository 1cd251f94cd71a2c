#include "base/assert.h"

#include <atomic>
#include <cstdlib>

namespace grapnel {
namespace {

std::atomic<AssertHandler> g_handler{nullptr};

}  // namespace

void set_assert_handler(AssertHandler handler) noexcept { g_handler.store(handler); }

void assertion_failed(const char* expression, const char* file, int line) noexcept {
  const AssertHandler handler = g_handler.load();
  if (handler != nullptr) handler(expression, file, line);
  std::abort();
}

}  // namespace grapnel
