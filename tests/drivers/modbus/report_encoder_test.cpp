#include "drivers/modbus/report_encoder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "drivers/modbus/pose_format.h"
#include "tests/drivers/modbus/support/scripted_device.h"

namespace grapnel {
namespace {

using test::accepted_object;

PlcResult one_object(const PlcObject& object) {
  PlcResult result;
  result.cmd_seq = 42;
  result.code = Code::ObjectFound;
  result.found = 3;
  result.pose_format = 1;
  result.frame_id = 0x00010002;
  result.enc_capture = 0xfffffff0;
  result.part_tag = 0xcafe0001;
  result.total_us = 70000;
  result.seed = 0x89abcdef;
  result.objects.push_back(object);
  return result;
}

TEST(RegisterImage, PutsTheHighWordFirstInAbcd) {
  RegisterImage image(WordOrder::Abcd);
  image.set_i32(902, -123456);    // 0xFFFE1DC0
  image.set_f32(904, 123456.0f);  // 0x47F12000
  EXPECT_EQ(image.u16(902), 0xfffe);
  EXPECT_EQ(image.u16(903), 0x1dc0);
  EXPECT_EQ(image.u16(904), 0x47f1);
  EXPECT_EQ(image.u16(905), 0x2000);
  EXPECT_EQ(image.i32(902), -123456);
}

TEST(RegisterImage, PutsTheLowWordFirstInCdab) {
  RegisterImage image(WordOrder::Cdab);
  image.set_u32(900, 0x12345678);
  EXPECT_EQ(image.u16(900), 0x5678);
  EXPECT_EQ(image.u16(901), 0x1234);
  EXPECT_EQ(image.u32(900), 0x12345678u);
}

TEST(ReportEncoder, WritesTheProbeAtItsAddresses) {
  RegisterImage image;
  encode_probe(70000, image);
  const std::uint16_t expected[12] = {0x1234, 0x5678, 0xfffe, 0x1dc0, 0x47f1, 0x2000,
                                      0x4142, 1,      4464,   0,      0,      0};
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(image.u16(900 + i), expected[i]) << 900 + i;
}

TEST(ReportEncoder, WritesTheResultAtTheAddressesOfTheMap) {
  PlcObject object = accepted_object();
  object.pick_point_id = 2;
  object.frame = PoseFrame::RobotBase;
  object.fitness = 0.98765;
  object.rmse_m = 0.0012345;
  object.coverage = 0.5;
  object.margin = 0.25;
  object.free_space_violation = 0.0149;
  object.sigma_m = 0.0007;
  object.sigma_rad = 0.01745329252;  // 1°
  object.quality_bits = kQualitySymmetric | kQualityRetried;
  object.quality_score = 900;
  RegisterImage image;
  encode_result(one_object(object), 5, true, image);
  EXPECT_EQ(image.u16(120), 5);
  EXPECT_EQ(image.u16(179), 5);
  EXPECT_EQ(image.u16(121), 42);
  EXPECT_EQ(image.u16(122), 3);
  EXPECT_EQ(image.u16(123), 1);
  EXPECT_EQ(image.u16(124), 1);
  EXPECT_EQ(image.u16(125), 2);
  EXPECT_EQ(image.u32(126), 0xfffffff0u);
  EXPECT_EQ(image.u32(132), 0xcafe0001u);
  EXPECT_EQ(image.u16(134), 7);       // MODEL_ID
  EXPECT_EQ(image.u16(135), 2);       // PICK_POINT_ID
  EXPECT_EQ(image.u16(136), 1);       // POSE_FORMAT
  EXPECT_EQ(image.u16(137), 1);       // FRAME
  EXPECT_EQ(image.u16(138), 0x0001);  // X = 123456 = 0x0001E240
  EXPECT_EQ(image.u16(139), 0xe240);
  EXPECT_EQ(image.i32(140), -200000);
  EXPECT_EQ(image.i32(142), 1500000);
  EXPECT_EQ(image.i32(144), 0);
  EXPECT_EQ(image.u16(152), 1);     // DECISION
  EXPECT_EQ(image.u16(153), 9876);  // FITNESS: 9876.5 rounds to even
  EXPECT_EQ(image.u16(154), 1234);  // RMSE_UM: 1234.5 rounds to even
  EXPECT_EQ(image.u16(155), 5000);  // COVERAGE
  EXPECT_EQ(image.u16(156), 2500);  // MARGIN
  EXPECT_EQ(image.u16(157), 149);   // FREE_SPACE_VIOL
  EXPECT_EQ(image.u16(158), 700);   // SIGMA_UM
  EXPECT_EQ(image.u16(159), 1000);  // SIGMA_MDEG
  EXPECT_EQ(image.u16(160), 0x21);  // QUALITY
  EXPECT_EQ(image.u16(161), 900);   // QUALITY_SCORE
  EXPECT_EQ(image.u16(162), 1100);  // OBJ_CODE
  EXPECT_EQ(image.u16(166), 1100);  // RES_CODE
  EXPECT_EQ(image.u32(168), 70000u);
  EXPECT_EQ(image.u32(172), 0x89abcdefu);
  EXPECT_EQ(image.u16(700), 5);       // float mirror
  EXPECT_EQ(image.u16(701), 0x42f6);  // 123.456f = 0x42F6E979
  EXPECT_EQ(image.u16(702), 0xe979);
  EXPECT_EQ(image.u16(715), 5);
}

TEST(ReportEncoder, WritesFurtherObjectsFortyRegistersApart) {
  PlcResult result = one_object(accepted_object());
  for (int i = 1; i < 8; ++i) {
    PlcObject object = accepted_object();
    object.model_id = static_cast<std::uint16_t>(100 + i);
    object.frame_from_grasp.translation().x() = 0.001 * i;
    result.objects.push_back(object);
  }
  RegisterImage image;
  encode_result(result, 77, true, image);
  for (std::size_t i = 1; i < 8; ++i) {
    const std::size_t base = 200 + 40 * (i - 1);
    EXPECT_EQ(image.u16(base), 77);
    EXPECT_EQ(image.u16(base + 1), 100 + i);
    EXPECT_EQ(image.i32(base + 5), static_cast<int>(1000 * i));
    EXPECT_EQ(image.u16(base + 39), 77);
    EXPECT_EQ(image.u16(700 + 16 * i), 77);
    EXPECT_EQ(image.u16(715 + 16 * i), 77);
  }
}

// Every pose register of all eight objects, integer and float.
void expect_sentinels(const RegisterImage& image, std::size_t first_object) {
  for (std::size_t i = first_object; i < 8; ++i) {
    const std::size_t record = i == 0 ? 134 : 201 + 40 * (i - 1);
    for (std::size_t k = 0; k < 7; ++k) {
      EXPECT_EQ(image.u32(record + 4 + 2 * k), 0x80000000u) << i << " " << k;
      const float real = std::bit_cast<float>(image.u32(701 + 16 * i + 2 * k));
      EXPECT_TRUE(std::isnan(real)) << i << " " << k;
    }
  }
}

TEST(ReportEncoder, ARejectedObjectHasNoPoseAndKeepsItsNumbers) {
  PlcObject object = accepted_object();
  object.accepted = false;
  object.code = Code::Ambiguous;
  object.reasons = 1u << 10 | 1u << 11;
  object.fitness = 0.8;
  RegisterImage image;
  encode_result(one_object(object), 1, false, image);
  expect_sentinels(image, 0);
  EXPECT_EQ(image.u16(152), 0);
  EXPECT_EQ(image.u16(153), 8000);
  EXPECT_EQ(image.u16(162), 1010);
  EXPECT_EQ(image.u32(163), 0xc00u);
}

TEST(ReportEncoder, WithoutResultValidNoObjectHasAPose) {
  PlcResult result = one_object(accepted_object());
  result.objects.push_back(accepted_object());
  RegisterImage image;
  encode_result(result, 1, true, image);
  EXPECT_EQ(image.i32(138), 123456);
  EXPECT_EQ(image.i32(205), 123456);
  encode_result(result, 1, false, image);
  expect_sentinels(image, 0);
}

TEST(ReportEncoder, ObjectsThatAreNotThereHaveNoPose) {
  RegisterImage image;
  encode_result(one_object(accepted_object()), 1, true, image);
  expect_sentinels(image, 1);
}

TEST(ReportEncoder, NoResultReadsZeroAndNoPose) {
  RegisterImage image;
  encode_result(one_object(accepted_object()), 9, true, image);
  encode_result(one_object(accepted_object()), 0, false, image);
  expect_sentinels(image, 0);
  EXPECT_EQ(image.u16(120), 0);
  EXPECT_EQ(image.u16(123), 0);
  EXPECT_EQ(image.u16(166), 0);
  EXPECT_EQ(image.u16(179), 0);
}

TEST(ReportEncoder, MeasuresSaturateAndNotANumberReadsTheWorst) {
  PlcObject object = accepted_object();
  object.rmse_m = 1.0;
  object.fitness = std::nan("");
  object.free_space_violation = std::nan("");
  object.sigma_m = std::numeric_limits<double>::infinity();
  object.margin = -0.2;
  RegisterImage image;
  encode_result(one_object(object), 1, true, image);
  EXPECT_EQ(image.u16(153), 0);
  EXPECT_EQ(image.u16(154), 65535);
  EXPECT_EQ(image.u16(156), 0);
  EXPECT_EQ(image.u16(157), 65535);
  EXPECT_EQ(image.u16(158), 65535);
}

TEST(ReportEncoder, ResultNumbersRunFrom1To65535AndLeaveOut0) {
  EXPECT_EQ(result_register(0), 0);
  EXPECT_EQ(result_register(1), 1);
  EXPECT_EQ(result_register(65535), 65535);
  EXPECT_EQ(result_register(65536), 1);
  EXPECT_EQ(result_register(2 * 65535ull + 3), 3);
}

TEST(ReportEncoder, WritesStatusAndDiagnosticsAtTheAddressesOfTheMap) {
  PlcStatus status;
  status.state = PlcState::Processing;
  status.heartbeat = 0x1111;
  status.status_code = Code::WarmingUp;
  status.status_detail = 3;
  status.active_preset = 12;
  status.preset_rev = 0xbeef;
  status.error_count = 9;
  status.uptime_s = 100'000;
  status.frame_count = 0x10000;
  status.boot_id = 0xb007;
  status.ack_code = Code::Busy;
  status.diagnostics.frames = 5;
  status.diagnostics.config_reloads = 6;
  status.diagnostics.belt_residual_um = -7;
  status.diagnostics.worst_job_us = 8;
  status.diagnostics.stage_us[0] = 11;
  status.diagnostics.stage_us[19] = 12;
  FieldBusCounters counters;
  counters.clients = 3;
  counters.bytes_discarded = 4;
  RegisterImage image;
  encode_status(status, 0x0102, 88, image);
  encode_diagnostics(status.diagnostics, counters, image);
  const std::uint16_t expected[16] = {256,    4, 0x0102, 0x1111, 88, 2010, 3,      12,
                                      0xbeef, 9, 1,      0x86a0, 1,  0,    0xb007, 3002};
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(image.u16(100 + i), expected[i]) << 100 + i;
  EXPECT_EQ(image.u32(600), 5u);
  EXPECT_EQ(image.u32(622), 3u);
  EXPECT_EQ(image.u32(630), 4u);
  EXPECT_EQ(image.u32(632), 6u);
  EXPECT_EQ(image.i32(636), -7);
  EXPECT_EQ(image.u32(644), 8u);
  EXPECT_EQ(image.u32(660), 11u);
  EXPECT_EQ(image.u32(698), 12u);
}

}  // namespace
}  // namespace grapnel
