#include "tests/fuzz/modbus_stream.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/rng.h"

namespace grapnel::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

const std::vector<Bytes> kSeeds = {
    {0, 1, 0, 0, 0, 6, 1, 3, 0, 100, 0, 80},
    {0, 2, 0, 0, 0, 6, 1, 4, 3, 132, 0, 12},
    {0, 3, 0, 0, 0, 6, 1, 6, 0, 26, 0, 1},
    {0, 4, 0, 0, 0, 11, 1, 16, 0, 0, 0, 2, 4, 0, 1, 0, 20},
    {0, 5, 0, 0, 0, 15, 1, 23, 0, 100, 0, 22, 0, 0, 0, 2, 4, 0, 2, 0, 20},
    {0, 6, 0, 0, 0, 5, 1, 43, 14, 2, 0},
    {0, 7, 0, 0, 0, 2, 1, 99},
};

Bytes random_stream(Rng& rng) {
  Bytes stream = {static_cast<std::uint8_t>(rng.below(256))};
  const std::uint32_t requests = 1 + rng.below(12);
  for (std::uint32_t i = 0; i < requests; ++i) {
    const Bytes& seed = kSeeds[rng.below(static_cast<std::uint32_t>(kSeeds.size()))];
    stream.insert(stream.end(), seed.begin(), seed.end());
  }
  for (std::uint32_t i = rng.below(4); i > 0; --i) {
    const std::size_t at = rng.below(static_cast<std::uint32_t>(stream.size()));
    switch (rng.below(4)) {
      case 0:
        stream[at] = static_cast<std::uint8_t>(rng.below(256));
        break;
      case 1:
        stream[at] ^= static_cast<std::uint8_t>(1u << rng.below(8));
        break;
      case 2:
        stream.erase(stream.begin() + static_cast<std::ptrdiff_t>(at));
        break;
      default:
        stream.insert(stream.begin() + static_cast<std::ptrdiff_t>(at),
                      static_cast<std::uint8_t>(rng.below(256)));
    }
    if (stream.empty()) stream.push_back(0);
  }
  return stream;
}

TEST(ModbusStream, EverySeedIsAnswered) {
  Bytes all = {2};
  for (const Bytes& seed : kSeeds) all.insert(all.end(), seed.begin(), seed.end());
  EXPECT_EQ(run_modbus_stream(all), kSeeds.size());
}

TEST(ModbusStream, MutatedRequestsBreakNoRule) {
  Rng rng(7);
  std::size_t answered = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Bytes stream = random_stream(rng);
    answered += run_modbus_stream(stream);
    run_rtu_stream(stream);
  }
  EXPECT_GT(answered, 50'000u) << "mutation leaves too little to answer";
}

TEST(ModbusStream, RandomBytesBreakNoRule) {
  Rng rng(8);
  for (int i = 0; i < 5'000; ++i) {
    Bytes stream(rng.below(600));
    for (std::uint8_t& byte : stream) byte = static_cast<std::uint8_t>(rng.below(256));
    run_modbus_stream(stream);
    run_rtu_stream(stream);
  }
}

}  // namespace
}  // namespace grapnel::test
