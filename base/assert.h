#pragma once

namespace grapnel {

/// Called with the failed expression; logs and terminates. A program may install its own (the
/// daemon writes its crash record first). The handler must not return.
using AssertHandler = void (*)(const char* expression, const char* file, int line) noexcept;

/// Replaces the handler for the whole process; nullptr restores the default (std::abort).
void set_assert_handler(AssertHandler handler) noexcept;

[[noreturn]] void assertion_failed(const char* expression, const char* file, int line) noexcept;

}  // namespace grapnel

/// A wrong program, as opposed to wrong input: on in every build.
#define GRAPNEL_ASSERT(expression)                                  \
  do {                                                              \
    if (!(expression)) [[unlikely]] {                               \
      ::grapnel::assertion_failed(#expression, __FILE__, __LINE__); \
    }                                                               \
  } while (false)
