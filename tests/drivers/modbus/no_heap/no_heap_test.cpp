// The field bus thread after open(): no heap call, whatever clients do to it. The C library's entry
// points are replaced in this program and counted a thread.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/drivers/modbus/support/hand_driven_server.h"
#include "tests/drivers/modbus/support/server_thread.h"

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);
}

namespace {

thread_local bool counted_thread = false;
std::atomic<int> heap_calls{0};
std::atomic<int> heap_calls_at_last_round{-1};  // before the thread itself is taken down

void note() noexcept {
  if (counted_thread) heap_calls.fetch_add(1);
}

}  // namespace

extern "C" {
void* malloc(std::size_t size) {
  note();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  note();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  note();
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
void free(void* block) {
  if (block != nullptr) note();
  __libc_free(block);
}
}

namespace grapnel::test {
namespace {

Bytes read_request(std::uint16_t first, std::uint8_t count) {
  return make_adu(1, 1, {4, HandDrivenServer::hi(first), HandDrivenServer::lo(first), 0, count});
}

// One of everything a client can do, right and wrong.
void exercise(std::uint16_t port) {
  RawClient plc(port);
  const std::vector<Bytes> requests = {
      read_request(100, 80),
      read_request(600, 100),
      read_request(900, 12),
      make_adu(2, 1, {16, 0, 0, 0, 2, 4, 0, 1, 0, 20}),
      make_adu(3, 1, {6, 0, 26, 0, 5}),
      make_adu(4, 1, {23, 0, 100, 0, 80, 0, 0, 0, 2, 4, 0, 2, 0, 82}),
      make_adu(5, 1, {0x2b, 14, 2, 0}),
      make_adu(6, 1, {0x63}),
      make_adu(7, 1, {3, 0, 100, 0, 0}),
      make_adu(8, 1, {3, 0, 50, 0, 1}),
      make_adu(9, 9, {6, 1, 0, 0, 1})};
  for (const Bytes& request : requests) {
    plc.send(request);
    ASSERT_FALSE(plc.wait_answer(5000).empty());
  }
  RawClient stranger(port, "127.0.0.9");
  RawClient garbage(port);
  garbage.send(Bytes(600, 'x'));
  EXPECT_TRUE(garbage.wait_answer(5000).empty());
  RawClient torn(port);
  torn.send({0, 1, 0, 0, 0, 6, 1});
  torn.close();
  plc.close();
}

TEST(ModbusNoHeap, TheFieldBusThreadCallsNoHeapAfterOpen) {
  ScriptedDevice device;
  device.result.objects.push_back(accepted_object());
  const MonotonicClock clock;
  LogRing log(clock);
  ModbusOptions options;
  options.log = &log;
  options.hooks.thread_started = [](void*) noexcept { counted_thread = true; };
  options.hooks.progress = [](void*) noexcept { heap_calls_at_last_round = heap_calls.load(); };
  int rounds_of_clients = 0;
  {
    ServerThread thread(test_config(), device, options);
    for (; rounds_of_clients < 20; ++rounds_of_clients) exercise(thread.port());
  }
  EXPECT_EQ(heap_calls_at_last_round.load(), 0);
  EXPECT_EQ(device.commands.size(), 40u);
}

TEST(ModbusNoHeap, TheCountWorks) {
  heap_calls = 0;
  counted_thread = true;
  {
    const std::vector<int> block(100);
    EXPECT_EQ(block.size(), 100u);
  }
  counted_thread = false;
  EXPECT_GE(heap_calls.load(), 2);
}

}  // namespace
}  // namespace grapnel::test
