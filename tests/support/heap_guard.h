#pragma once

#include <cstdint>
#include <string>

namespace grapnel::test {

/// Counts the calls to malloc, free and their kin on the threads that ask for it. Linking
/// grapnel_heap_guard replaces the C library's entry points for the whole program; under a
/// sanitizer, which brings its own, nothing is replaced and nothing is counted.
[[nodiscard]] bool heap_guard_works() noexcept;

/// Why not, for GTEST_SKIP.
inline constexpr const char* kNoHeapGuard = "the sanitizer's allocator can't be counted";

/// From here on the calling thread's heap calls count, from 0.
void arm_heap_guard() noexcept;
void disarm_heap_guard() noexcept;
/// The calling thread's heap calls while armed.
[[nodiscard]] std::uint64_t heap_calls() noexcept;
/// Heap calls of all threads since the program began, armed or not.
[[nodiscard]] std::uint64_t heap_calls_of_all() noexcept;
/// The stack of the first counted call of any thread since the last clear, "" when there was none.
[[nodiscard]] std::string first_heap_call();
void clear_first_heap_call() noexcept;

}  // namespace grapnel::test
