#include "drivers/freenect/packet_assembler.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace grapnel {
namespace {

/// Frames of three packets of four bytes, as text; '.' is what did not arrive.
class AssembledFrame : public testing::Test {
 protected:
  void add(int number, const std::string& data) {
    assembler_.add(frame_.data(), reinterpret_cast<const std::uint8_t*>(data.data()), number,
                   data.size());
  }
  [[nodiscard]] std::string frame() const { return {frame_.begin(), frame_.end()}; }

  std::vector<std::uint8_t> frame_ = std::vector<std::uint8_t>(12, '?');
  PacketAssembler assembler_{4, 12, '.'};
};

TEST_F(AssembledFrame, HoldsItsPackets) {
  add(0, "aaaa");
  add(1, "bbbb");
  add(2, "cccc");
  EXPECT_EQ(frame(), "aaaabbbbcccc");
}

TEST_F(AssembledFrame, IsBlankWhereAPacketWasLostAlsoAfterAnEarlierFrame) {
  add(0, "aaaa");
  add(2, "cccc");
  EXPECT_EQ(frame(), "aaaa....cccc");
  assembler_.next_frame();
  add(1, "BBBB");
  add(2, "CC");
  EXPECT_EQ(frame(), "....BBBBCC..");
}

TEST_F(AssembledFrame, IsNotTouchedByTheNextOneThatArrivesBeforeItsDelivery) {
  add(0, "aaaa");
  add(1, "bbbb");
  add(0, "AAAA");
  EXPECT_EQ(frame(), "aaaabbbb....");
  assembler_.next_frame();
  EXPECT_EQ(frame(), "AAAA........");
  add(1, "BBBB");
  EXPECT_EQ(frame(), "AAAABBBB....");
}

TEST_F(AssembledFrame, ThatTheLibraryGaveUpLeavesNothingBehind) {
  add(0, "aaaa");
  add(1, "bbbb");
  add(0, "AAAA");
  add(2, "CCCC");
  EXPECT_EQ(frame(), "AAAA....CCCC");
}

TEST_F(AssembledFrame, IgnoresWhatWouldLieOutside) {
  add(5, "xxxx");
  add(-1, "xxxx");
  EXPECT_EQ(frame(), "............");
}

}  // namespace
}  // namespace grapnel
