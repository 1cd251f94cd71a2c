#include "tests/support/heap_guard.h"

namespace grapnel::test {

bool heap_guard_works() noexcept { return false; }
void arm_heap_guard() noexcept {}
void disarm_heap_guard() noexcept {}
std::uint64_t heap_calls() noexcept { return 0; }
std::uint64_t heap_calls_of_all() noexcept { return 0; }
std::string first_heap_call() { return {}; }
void clear_first_heap_call() noexcept {}

}  // namespace grapnel::test
