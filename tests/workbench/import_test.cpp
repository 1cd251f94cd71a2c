#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording.h"
#include "tests/support/temp_folder.h"
#include "workbench/import/cloud_grid.h"
#include "workbench/import/fakenect.h"
#include "workbench/import/known_cameras.h"
#include "workbench/import/local_recording.h"
#include "workbench/import/source.h"
#include "workbench/import/tiff.h"
#include "workbench/import/write_source.h"
#include "workbench/input.h"

namespace grapnel {
namespace {

/// A TIFF put together entry by entry after TIFF 6.0.
class TiffText {
 public:
  explicit TiffText(bool big_endian) : big_endian_(big_endian) {
    text_ = big_endian ? "MM" : "II";
    u16(42);
    u32(8);
  }
  void u16(std::uint32_t value) { number(value, 2); }
  void u32(std::uint32_t value) { number(value, 4); }
  void entry(std::uint32_t tag, std::uint32_t type, std::uint32_t value) {
    u16(tag);
    u16(type);
    u32(1);
    if (type == 3) {
      u16(value);
      u16(0);
    } else {
      u32(value);
    }
  }
  void raw(const std::string& bytes) { text_ += bytes; }
  [[nodiscard]] std::span<const std::byte> bytes() const {
    return std::as_bytes(std::span(text_.data(), text_.size()));
  }

 private:
  void number(std::uint32_t value, int count) {
    for (int i = 0; i < count; ++i) {
      const int shift = 8 * (big_endian_ ? count - 1 - i : i);
      text_ += static_cast<char>((value >> shift) & 0xff);
    }
  }

  bool big_endian_;
  std::string text_;
};

/// A 3×1 image of `bits`, its only strip behind the directory.
TiffText tiff(bool big_endian, std::uint32_t compression, std::uint32_t bits,
              std::uint32_t channels, const std::string& strip) {
  TiffText text(big_endian);
  constexpr std::uint32_t kEntries = 8;
  text.u16(kEntries);
  text.entry(256, 3, 3);
  text.entry(257, 3, 1);
  text.entry(258, 3, bits);
  text.entry(259, 3, compression);
  text.entry(273, 4, 8 + 2 + kEntries * 12 + 4);
  text.entry(277, 3, channels);
  text.entry(278, 3, 1);
  text.entry(279, 4, static_cast<std::uint32_t>(strip.size()));
  text.u32(0);
  text.raw(strip);
  return text;
}

TEST(Tiff, ReadsSixteenBitsInEitherByteOrder) {
  const std::vector<std::uint16_t> expected = {0x0102, 0x0304, 0x0506};
  EXPECT_EQ(decode_depth_tiff(tiff(false, 1, 16, 1, {"\2\1\4\3\6\5", 6}).bytes(), "t").pixels,
            expected);
  EXPECT_EQ(decode_depth_tiff(tiff(true, 1, 16, 1, {"\1\2\3\4\5\6", 6}).bytes(), "t").pixels,
            expected);
}

TEST(Tiff, UnpacksTheRunsAndLiteralsOfPackBits) {
  // 0xfd: the next byte four times; 0x80: nothing; 1: two bytes as they are.
  const std::string strip("\xfd\x07\x80\x01\x0a\x0b", 6);
  EXPECT_EQ(decode_depth_tiff(tiff(false, 32773, 16, 1, strip).bytes(), "t").pixels,
            (std::vector<std::uint16_t>{0x0707, 0x0707, 0x0b0a}));
}

TEST(Tiff, ReadsThreeChannels) {
  EXPECT_EQ(decode_color_tiff(tiff(false, 1, 8, 3, "abcdefghi").bytes(), "t").pixels,
            (std::vector<Rgb8>{{'a', 'b', 'c'}, {'d', 'e', 'f'}, {'g', 'h', 'i'}}));
}

TEST(Tiff, RefusesWhatItCantReadAndFilesCutAnywhere) {
  const TiffText whole = tiff(false, 32773, 16, 1, {"\xfb\x07", 2});
  EXPECT_NO_THROW((void)decode_depth_tiff(whole.bytes(), "t"));
  for (std::size_t size = 0; size < whole.bytes().size(); ++size) {
    EXPECT_THROW((void)decode_depth_tiff(whole.bytes().first(size), "t"), InputError) << size;
  }
  EXPECT_THROW((void)decode_depth_tiff(tiff(false, 5, 16, 1, "abcdef").bytes(), "t"), InputError);
  EXPECT_THROW((void)decode_depth_tiff(tiff(false, 1, 8, 3, "abcdefghi").bytes(), "t"), InputError);
  EXPECT_THROW((void)decode_depth_tiff(tiff(false, 1, 16, 1, "abcde").bytes(), "t"), InputError);
}

TEST(ImportNames, TimesInNamesAreUtc) {
  // date -u -d "2012-12-14 14:22:55" +%s
  EXPECT_EQ(time_in_name("frame_20121214T142255.814212_depth.tiff"), 1355494975814212);
  EXPECT_EQ(time_in_name("20000229T000000.000001.pcd"), 951782400000001);
  EXPECT_EQ(time_in_name("capture0001.pcd"), std::nullopt);
}

CloudData grid_of(const CameraFile& camera, double sign) {
  CloudData cloud;
  cloud.width = camera.width;
  cloud.height = camera.height;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double z = 1.0 + 0.01 * ((u * 7 + v * 3) % 50);
      const bool none = (u + v) % 9 == 0;
      constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
      cloud.x.push_back(none ? kNone : static_cast<float>((u - camera.cx) / camera.fx * z));
      cloud.y.push_back(none ? kNone : static_cast<float>(sign * (v - camera.cy) / camera.fy * z));
      cloud.z.push_back(none ? kNone : static_cast<float>(sign * z));
    }
  }
  return cloud;
}

TEST(CloudGrid, FindsTheCameraThatMadeTheCloudWhicheverWayItLooks) {
  CameraFile camera;
  camera.width = 40;
  camera.height = 30;
  camera.fx = 50.0;
  camera.fy = 52.0;
  camera.cx = 19.25;
  camera.cy = 14.75;
  for (const double sign : {1.0, -1.0}) {
    const std::optional<CameraFile> found = estimate_camera(grid_of(camera, sign));
    ASSERT_TRUE(found.has_value());
    // Floats carry seven digits.
    EXPECT_NEAR(found->fx, camera.fx, 1e-4);
    EXPECT_NEAR(found->fy, camera.fy, 1e-4);
    EXPECT_NEAR(found->cx, camera.cx, 1e-4);
    EXPECT_NEAR(found->cy, camera.cy, 1e-4);
  }
}

TEST(CloudGrid, RefusesAGridThatNoPinholeCameraMade) {
  CameraFile camera;
  camera.width = 40;
  camera.height = 30;
  camera.fx = camera.fy = 50.0;
  camera.cx = 20.0;
  camera.cy = 15.0;
  CloudData bent = grid_of(camera, 1.0);
  for (float& x : bent.x) x += 0.1f * x * x;
  EXPECT_FALSE(estimate_camera(bent).has_value());
  CloudData flat = grid_of(camera, 1.0);
  flat.width *= flat.height;
  flat.height = 1;
  EXPECT_FALSE(estimate_camera(flat).has_value());
}

TEST(CloudGrid, TakesMillimetresWhereTheyAreWhole) {
  CloudData cloud;
  cloud.width = 2;
  cloud.height = 2;
  cloud.x = cloud.y = {0.0f, 0.0f, 0.0f, 0.0f};
  cloud.z = {1.234f, 0.5f, std::numeric_limits<float>::quiet_NaN(), 100.0f};
  EXPECT_EQ(fitting_unit_m(cloud), 0.001);
  EXPECT_EQ(depth_of(cloud, 0.001).pixels, (std::vector<std::uint16_t>{1234, 500, 0, 0}));
  cloud.z[1] = 0.5002f;
  EXPECT_EQ(fitting_unit_m(cloud), 0.0002);
  EXPECT_EQ(depth_of(cloud, 0.0002).pixels[1], 2501);
}

TEST(KnownCameras, AreFoundByTheSetsName) {
  EXPECT_EQ(known_camera("# file: 'rgbd_dataset_freiburg1_rpy.bag'")->camera.fx, 517.3);
  EXPECT_FALSE(known_camera("living_room").has_value());
  EXPECT_EQ(nominal_camera(320, 240).camera.fx, 262.5);
}

TEST(FindSource, KnowsPoseFilesOfATrackerThatWasLost) {
  const test::TempFolder folder;
  const auto write = [&](const char* name, std::string_view text) {
    write_file(folder / name, text);
  };
  write("frame-000001.pose.txt", "nan nan nan nan 0 0 0 0 0 0 0 0 0 0 0 1");
  write("frame-000002.pose.txt", "1 0 0 1  0 1 0 2  0 0 1 3  0 0 0 1");
  EXPECT_FALSE(read_pose_matrix(folder / "frame-000001.pose.txt").has_value());
  const std::optional<Pose> pose = read_pose_matrix(folder / "frame-000002.pose.txt");
  ASSERT_TRUE(pose.has_value());
  EXPECT_EQ(pose->translation(), Vec3d(1, 2, 3));
  write("short.txt", "1 0 0 1");
  EXPECT_THROW((void)read_pose_matrix(folder / "short.txt"), InputError);
}

TEST(FindSource, ListsNumberedFilesByNumberNotByText) {
  const test::TempFolder folder;
  for (const char* name : {"depth_10.png", "depth_9.png", "depth_x.png", "color_1.png"}) {
    write_file(folder / name, std::string_view());
  }
  const std::vector<NumberedFile> files = numbered_files(folder.path(), "depth_", ".png");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].number, 9u);
  EXPECT_EQ(files[1].number, 10u);
}

TEST(FindSource, SaysWhenNothingFits) {
  const test::TempFolder folder;
  EXPECT_THROW((void)find_source(folder.path(), {}), InputError);
  EXPECT_THROW((void)find_source(folder / "absent", {}), InputError);
}

/// A session as fakenect-record writes it: three depth images, two of colour, one of tilt.
class Fakenect : public ::testing::Test {
 protected:
  Fakenect() {
    for (int i = 0; i < 3; ++i) {
      std::string depth = "P5 640 480 65535\n";
      for (std::size_t pixel = 0; pixel < 307200; ++pixel) {
        const unsigned raw = pixel == 0 ? 2047 : pixel == 1 ? 800 : 600;
        depth += static_cast<char>(raw & 0xff);
        depth += static_cast<char>(raw >> 8);
      }
      write("d-129557013" + std::to_string(i) + ".250000-33123.pgm", depth);
    }
    const std::string color = "P6 640 480 255\n" + std::string(921600, 'x');
    write("r-1295570130.260000-33124.ppm", color);
    write("r-1295570131.260000-33125.ppm", color);
    write("a-1295570130.255000-0.dump", std::string(12, '\0'));
    save_index();
  }
  void write(const std::string& name, const std::string& text) {
    write_file(folder_ / name, text);
    index_ += name + "\n";
  }
  void save_index() { write_file(folder_ / "INDEX.txt", index_); }
  [[nodiscard]] std::string refusal() const {
    try {
      (void)find_source(folder_.path(), {});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  test::TempFolder folder_;
  std::string index_;
};

TEST_F(Fakenect, IsFoundWithItsTimesAndAKinectsNominalConstants) {
  const Source source = find_source(folder_.path(), {});
  EXPECT_EQ(source.layout, "fakenect");
  ASSERT_EQ(source.frames.size(), 3U);
  EXPECT_EQ(source.frames[0].time_us, 1'295'570'130'250'000);
  EXPECT_EQ(source.colors.size(), 2U);
  EXPECT_TRUE(source.unregistered_color);
  EXPECT_NEAR(source.camera->fx, 575.8, 0.1);  // 120 / 0.1042 / 2
}

TEST_F(Fakenect, DepthIsThatOfTheTangentFitWithinAPercent) {
  // Magnenat's fit in OpenKinect's wiki: 0.1236 tan(raw / 2842.5 + 1.1863) metres.
  const DepthImage image = read_fakenect_depth(find_source(folder_.path(), {}).frames[0].depth);
  const auto metres = [&](std::size_t pixel) { return image.pixels[pixel] * 0.0002; };
  EXPECT_EQ(image.pixels[0], 0);
  EXPECT_NEAR(metres(1), 0.1236 * std::tan(800 / 2842.5 + 1.1863), 0.012);
  EXPECT_NEAR(metres(2), 0.1236 * std::tan(600 / 2842.5 + 1.1863), 0.007);
}

TEST_F(Fakenect, ATruncatedFileIsRefusedWithItsLineAndLeftOutOnRequest) {
  const std::string name = "d-1295570131.250000-33123.pgm";
  std::filesystem::resize_file(folder_ / name, 100'000);
  const std::string why = refusal();
  EXPECT_NE(why.find("INDEX.txt:2: " + name + " has 100000 bytes; 614417 belong there"),
            std::string::npos)
      << why;
  SourceOptions options;
  options.skip_damaged = true;
  const Source source = find_source(folder_.path(), options);
  EXPECT_EQ(source.frames.size(), 2U);
  EXPECT_EQ(source.left_out, 1U);
}

TEST_F(Fakenect, NamesThatLeadElsewhereAreRefused) {
  for (const char* name : {"../../d-1.5-2.pgm", "d-x-2.pgm", "d-1.5.pgm", "-", "d--.pgm"}) {
    index_ = std::string(name) + "\n";
    save_index();
    EXPECT_NE(refusal().find("INDEX.txt:1: "), std::string::npos) << name << ": " << refusal();
  }
}

TEST_F(Fakenect, ValuesBeyondElevenBitsAreRefused) {
  std::string depth = "P5 640 480 65535\n" + std::string(614400, '\x7f');
  write("d-1295570139.250000-33123.pgm", depth);
  EXPECT_THROW((void)read_fakenect_depth(folder_ / "d-1295570139.250000-33123.pgm"), InputError);
}

TEST_F(Fakenect, AMissingFileIsRefused) {
  std::filesystem::remove(folder_ / "r-1295570131.260000-33125.ppm");
  EXPECT_NE(refusal().find("INDEX.txt:5: r-1295570131.260000-33125.ppm is not there"),
            std::string::npos)
      << refusal();
}

TEST_F(Fakenect, FrameIsAnInputAsItIs) {
  const Input input = load_input(folder_.path().string() + "#1", {});
  ASSERT_TRUE(input.is_frame());
  const DepthFrame frame = input.frame();
  EXPECT_EQ(frame.depth.width, 640);
  EXPECT_EQ(frame.depth.at(0, 0), 0) << "2047 is no reading";
  // libfreenect's law with its nominal constants (registration.c): raw 800 is the reference plane
  // but for 3/8 pixel, raw 600 fifty pixels nearer.
  const auto depth_m = [](double shift_px) {
    return 0.01 * (shift_px * 0.1042 * 120.0 / (7.5 - shift_px * 0.1042) + 120.0);
  };
  EXPECT_NEAR(frame.depth.at(1, 0) * frame.metres_per_unit, depth_m(-0.375), 1e-4);
  EXPECT_NEAR(frame.depth.at(2, 0) * frame.metres_per_unit, depth_m(-50.375), 1e-4);
  EXPECT_EQ(frame.exposure_us, 1295570131250000);
  EXPECT_THROW((void)load_input(folder_.path().string() + "#3", {}), InputError);
}

TEST_F(Fakenect, KeepsItsUnitUnderACalibrationOfAnother) {
  CameraFile calibrated;
  calibrated.width = 640;
  calibrated.height = 480;
  calibrated.fx = calibrated.fy = 580.0;
  calibrated.cx = 320.0;
  calibrated.cy = 240.0;
  calibrated.metres_per_unit = 0.001;
  const std::string camera = (folder_ / "camera.toml").string();
  write_file(camera, std::string_view(camera_file_text(calibrated)));
  const Input plain = load_input(folder_.path().string() + "#0", {});
  const Input input = load_input(folder_.path().string() + "#0", {camera, ""});
  EXPECT_EQ(input.frame().intrinsics.fx, 580.0);
  EXPECT_EQ(input.frame().metres_per_unit, plain.frame().metres_per_unit);
  Source source = find_source(folder_.path(), {});
  EXPECT_EQ(choose_camera(source, camera).metres_per_unit, plain.frame().metres_per_unit);
}

TEST_F(Fakenect, FolderIsARecordingThatGoesAwayAfterUse) {
  std::filesystem::path folder;
  {
    const LocalRecording local(folder_.path().string());
    folder = local.folder();
    const Recording recording = Recording::open(folder);
    EXPECT_EQ(recording.frame_count(), 3U);
    EXPECT_FALSE(recording.has_color()) << "it is not that of the depth's pixels";
  }
  EXPECT_FALSE(std::filesystem::exists(folder));
  const LocalRecording own((folder_ / "elsewhere").string());
  EXPECT_EQ(own.folder(), folder_ / "elsewhere");
}

}  // namespace
}  // namespace grapnel
