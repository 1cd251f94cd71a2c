#include "pipeline/kernels/label_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

class LabelRows : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }

  static std::vector<std::uint16_t> readings(std::size_t count, std::uint32_t below) {
    Rng rng(9);
    std::vector<std::uint16_t> depth(count);
    for (std::uint16_t& value : depth) value = static_cast<std::uint16_t>(rng.below(below));
    return depth;
  }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, LabelRows, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

TEST_P(LabelRows, KeepWhatIsAboveThePlaneAsAPlainLoopDoes) {
  const kernels::PlaneRow plane = {0.001F, 0.9F, 1e-4F, 1.05F};
  for (const kernels::HeightLaw& law :
       {kernels::HeightLaw{0.004F, 0.0F, 0.006F}, kernels::HeightLaw{0.004F, 0.02F, 0.0F}}) {
    for (const std::size_t count : {1U, 8U, 37U, 640U}) {
      const std::vector<std::uint16_t> depth = readings(count, 1400);
      std::vector<std::uint8_t> label(count, 7);
      kernels::keep_above_plane(depth.data(), count, plane, law, label.data());
      for (std::size_t u = 0; u < count; ++u) {
        const float depth_m = static_cast<float>(depth[u]) * plane.metres_per_unit;
        const float above_m =
            plane.offset_m * (1.0F - depth_m * (plane.start + plane.a * static_cast<float>(u)));
        const float needed = std::max(law.noise * plane.offset_m * depth_m,
                                      std::max(law.height_m, law.ratio * depth_m));
        ASSERT_EQ(label[u], above_m > needed ? 7 : 0) << u << " of " << count;
      }
    }
  }
}

TEST_P(LabelRows, CopyWhatIsInRangeAsAPlainLoopDoes) {
  struct Range {
    std::uint16_t least, most;
  };
  for (const Range range :
       {Range{1, 65535}, Range{300, 900}, Range{65535, 0}, Range{40000, 65535}}) {
    for (const std::size_t count : {1U, 16U, 53U, 640U}) {
      const std::vector<std::uint16_t> from = readings(count, range.least == 300 ? 1200 : 65536);
      std::vector<std::uint16_t> depth(count, 5);
      std::vector<std::uint8_t> label(count, 5);
      const std::size_t kept = kernels::copy_in_range(from.data(), count, range.least, range.most,
                                                      255, depth.data(), label.data());
      std::size_t valid = 0;
      for (std::size_t u = 0; u < count; ++u) {
        const bool in_range = from[u] >= range.least && from[u] <= range.most;
        valid += in_range ? 1U : 0U;
        ASSERT_EQ(depth[u], in_range ? from[u] : 0);
        ASSERT_EQ(label[u], in_range ? 255 : 0);
      }
      EXPECT_EQ(kept, valid);
    }
  }
}

}  // namespace
}  // namespace grapnel
