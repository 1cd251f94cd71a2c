#include "drivers/replay/recording.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/frame_file.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording_writer.h"
#include "tests/support/small_recording.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

constexpr std::size_t kPixels = std::size_t{test::kSmallWidth} * test::kSmallHeight;

template <class Run>
std::string message_of(Run run) {
  try {
    run();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(RecordingIndex, ReadsTimesAsWholeMicroseconds) {
  std::int64_t time_us = 0;
  ASSERT_TRUE(parse_time("1305031229.528784", time_us));
  EXPECT_EQ(time_us, 1305031229528784);
  ASSERT_TRUE(parse_time("1305031225.9334", time_us));
  EXPECT_EQ(time_us, 1305031225933400);
  ASSERT_TRUE(parse_time("7", time_us));
  EXPECT_EQ(time_us, 7000000);
  ASSERT_TRUE(parse_time("0.9999996", time_us));
  EXPECT_EQ(time_us, 1000000);
  for (const char* bad : {"", "-1", "1e5", "1.2.3", ".", "nan", "99999999999999999999", "0x1"}) {
    EXPECT_FALSE(parse_time(bad, time_us)) << bad;
  }
  EXPECT_EQ(time_text(1305031229028784), "1305031229.028784");
}

TEST(RecordingIndex, NamesTheLineThatIsWrong) {
  const auto index = [](std::string_view text) {
    return message_of([&] { (void)parse_index(text, "depth.txt"); });
  };
  EXPECT_EQ(index("# c\n1.0 a.png\nx b.png\n"), "depth.txt:3: \"x\" is not a time in seconds");
  EXPECT_EQ(index("1.0\n2.0 b.png\n"), "depth.txt:1: the image's file name is missing");
  EXPECT_EQ(index("1.0 ../secret.png\n"),
            "depth.txt:1: \"../secret.png\" is not allowed; a path inside the recording is");
  EXPECT_EQ(index("1.0 /etc/passwd\n"),
            "depth.txt:1: \"/etc/passwd\" is not allowed; a path inside the recording is");
  const auto poses = [](std::string_view text) {
    return message_of([&] { (void)parse_poses(text, "groundtruth.txt"); });
  };
  EXPECT_EQ(poses("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 1\n"),
            "groundtruth.txt:2: a pose is: time tx ty tz qx qy qz qw");
  EXPECT_EQ(poses("1 0 0 0 0 0 0 2\n"), "groundtruth.txt:1: the quaternion's length is not 1");
}

TEST(RecordingIndex, LeavesOutALastLineThatWasCutOff) {
  EXPECT_EQ(parse_index("1.0 a.png\n2.", "depth.txt").size(), 1u);
  EXPECT_EQ(parse_index("1.0 a.png\n2.0", "depth.txt").size(), 1u);
  EXPECT_EQ(parse_poses("1 0 0 0 0 0 0 1\n2 0 0", "groundtruth.txt").size(), 1u);
}

TEST(RecordingIndex, ReadsAPoseAsPositionAndQuaternionWithTheRealPartLast) {
  // A quarter turn about z takes x to y.
  const auto poses = parse_poses("3.5 1 2 3 0 0 0.70710678 0.70710678\n", "groundtruth.txt");
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_EQ(poses[0].time_us, 3500000);
  EXPECT_LT((poses[0].pose * Vec3d(1, 0, 0) - Vec3d(1, 3, 3)).norm(), 1e-8);
  const auto again = parse_poses(pose_line(poses[0]), "again");
  EXPECT_LT((again[0].pose.matrix() - poses[0].pose.matrix()).norm(), 1e-12);
}

TEST(RecordingIndex, FindsTheNearestTimeWithinTheLimit) {
  const std::vector<std::int64_t> times = {100, 200, 300};
  EXPECT_EQ(nearest_time(times, 240, 50), 1u);
  EXPECT_EQ(nearest_time(times, 260, 50), 2u);
  EXPECT_EQ(nearest_time(times, 351, 50), 3u);
  EXPECT_EQ(nearest_time(times, 350, 50), 2u);
  EXPECT_EQ(nearest_time({}, 0, 50), 0u);
}

TEST(Recording, GivesBackWhatWasWritten) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 3, true);
  const Recording recording = Recording::open(folder / "r");
  ASSERT_EQ(recording.frame_count(), 3u);
  EXPECT_TRUE(recording.has_color());
  EXPECT_FALSE(recording.index_rebuilt());
  EXPECT_EQ(recording.time_us(2), test::kSmallStart_us + 2 * test::kSmallInterval_us);
  EXPECT_EQ(recording.interval_us(), test::kSmallInterval_us);
  EXPECT_EQ(recording.camera().serial, "SMALL-1");
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<Rgb8> color(kPixels);
  for (std::size_t frame = 0; frame < 3; ++frame) {
    EXPECT_TRUE(recording.read_frame(frame, depth, color));
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      ASSERT_EQ(depth[pixel], test::small_depth(frame, pixel));
      ASSERT_EQ(color[pixel], test::small_color(frame, pixel));
    }
  }
}

TEST(Recording, MapsInvalidCountsToZeroAsCameraTomlSays) {
  const test::TempFolder folder;
  CameraFile camera = test::small_camera();
  camera.invalid = {0.0, 65535.0};
  RecordingWriter writer(folder / "r", camera);
  std::vector<std::uint16_t> depth(kPixels, 1234);
  depth[5] = 65535;
  writer.add_depth(1000000, {depth.data(), test::kSmallWidth, test::kSmallHeight});
  Recording::open(folder / "r").read_frame(0, depth, {});
  EXPECT_EQ(depth[5], 0);
  EXPECT_EQ(depth[6], 1234);
}

TEST(Recording, RebuildsALostIndexFromTheImagesNames) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 4, true);
  std::filesystem::remove(folder / "r/depth.txt");
  std::filesystem::remove(folder / "r/rgb.txt");
  const Recording recording = Recording::open(folder / "r");
  EXPECT_TRUE(recording.index_rebuilt());
  ASSERT_EQ(recording.frame_count(), 4u);
  EXPECT_EQ(recording.time_us(3), test::kSmallStart_us + 3 * test::kSmallInterval_us);
  EXPECT_TRUE(recording.has_color(3));
}

TEST(Recording, PairsColourOnlyWithinTwentyMilliseconds) {
  const test::TempFolder folder;
  RecordingWriter writer(folder / "r", test::small_camera());
  const std::vector<std::uint16_t> depth(kPixels, 900);
  const std::vector<Rgb8> color(kPixels, Rgb8{1, 2, 3});
  const auto add_depth = [&](std::int64_t time_us) {
    writer.add_depth(time_us, {depth.data(), test::kSmallWidth, test::kSmallHeight});
  };
  add_depth(1'000'000);
  add_depth(1'033'000);
  writer.add_color(1'012'000, {color.data(), test::kSmallWidth, test::kSmallHeight});
  const Recording recording = Recording::open(folder / "r");
  EXPECT_TRUE(recording.has_color(0));
  EXPECT_FALSE(recording.has_color(1));
  std::vector<std::uint16_t> out(kPixels);
  std::vector<Rgb8> out_color(kPixels);
  EXPECT_FALSE(recording.read_frame(1, out, out_color));
}

TEST(Recording, NamesFrameAndFileOfWhatItCantRead) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 2, false);
  std::filesystem::remove(folder / "r/depth/1700000000.010000.png");
  const Recording recording = Recording::open(folder / "r");
  std::vector<std::uint16_t> depth(kPixels);
  recording.read_frame(0, depth, {});
  const std::string message = message_of([&] { recording.read_frame(1, depth, {}); });
  EXPECT_NE(message.find("frame 1: "), std::string::npos) << message;
  EXPECT_NE(message.find("depth/1700000000.010000.png: can't be opened"), std::string::npos)
      << message;
}

TEST(Recording, SaysWhenAnImageHasAnotherSizeThanCameraToml) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 1, false);
  const std::vector<std::uint16_t> wide(40 * 24, 1);
  write_depth_png(folder / "r/depth/1700000000.000000.png", {wide.data(), 40, 24});
  std::vector<std::uint16_t> depth(kPixels);
  const Recording recording = Recording::open(folder / "r");
  const std::string message = message_of([&] { recording.read_frame(0, depth, {}); });
  EXPECT_NE(message.find("40 by 24 pixels; 32 by 24 are expected"), std::string::npos) << message;
}

TEST(Recording, RefusesAFolderThatIsNone) {
  const test::TempFolder folder;
  EXPECT_THROW((void)Recording::open(folder / "absent"), InputError);
  EXPECT_THROW((void)Recording::open(folder.path()), InputError);
  write_file(folder / "camera.toml", std::string_view(camera_file_text(test::small_camera())));
  const std::string message = message_of([&] { (void)Recording::open(folder.path()); });
  EXPECT_NE(message.find("the recording has no frame"), std::string::npos) << message;
}

TEST(Recording, OpensOrRefusesItsIndexCutAtAnyByte) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 3, false);
  const std::vector<std::byte> whole = read_file(folder / "r/depth.txt", 1 << 16);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write_file(folder / "r/depth.txt", std::span(whole).first(size));
    std::size_t frames = 0;
    try {
      const Recording recording = Recording::open(folder / "r");
      frames = recording.frame_count();
      std::vector<std::uint16_t> depth(kPixels);
      recording.read_frame(0, depth, {});
    } catch (const InputError&) {
      continue;
    }
    EXPECT_LE(frames, 3u);
  }
}

TEST(RecordingWriter, NeverListsAnImageThatIsNotThere) {
  const test::TempFolder folder;
  RecordingWriter writer(folder / "r", test::small_camera());
  std::filesystem::remove(folder / "r/depth");
  const std::vector<std::uint16_t> depth(kPixels, 900);
  EXPECT_THROW(writer.add_depth(1, {depth.data(), test::kSmallWidth, test::kSmallHeight}),
               InputError);
  EXPECT_TRUE(read_index(folder / "r/depth.txt").empty());
}

TEST(RecordingWriter, RefusesToWriteOverARecording) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 1, false);
  EXPECT_THROW(RecordingWriter(folder / "r", test::small_camera()), InputError);
}

TEST(FrameFile, ReadsAFrameOfARecordingByItsNumber) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 3, true);
  const FrameFile file = read_frame_file((folder / "r").string() + "#2", {}, {});
  const DepthFrame frame = file.frame();
  EXPECT_EQ(frame.sequence, 2u);
  EXPECT_EQ(test::frame_shown(frame.depth), 2u);
  EXPECT_EQ(frame.color.at(3, 0), test::small_color(2, 3));
  EXPECT_TRUE(frame.recorded);
  EXPECT_EQ(frame.intrinsics, test::small_camera().intrinsics());
  EXPECT_NE(message_of([&] {
              (void)read_frame_file((folder / "r").string() + "#3", {}, {});
            }).find("there is no frame 3; 0 to 2 are there"),
            std::string::npos);
}

TEST(FrameFile, ReadsABarePngWithItsCamera) {
  const test::TempFolder folder;
  test::write_small_recording(folder / "r", 1, false);
  const std::string png = (folder / "r/depth/1700000000.000000.png").string();
  const FrameFile file = read_frame_file(png, (folder / "r/camera.toml").string(), {});
  EXPECT_EQ(test::frame_shown(file.frame().depth), 0u);
  EXPECT_TRUE(file.frame().color.empty());
  EXPECT_NE(message_of([&] { (void)read_frame_file(png, {}, {}); }).find("--camera"),
            std::string::npos);
}

}  // namespace
}  // namespace grapnel
