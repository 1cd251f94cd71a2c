#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "drivers/modbus/registers.h"
#include "drivers/replay/recording_writer.h"
#include "drivers/synthetic/scene.h"
#include "drivers/synthetic/scene_renderer.h"
#include "tests/system/daemon_process.h"

namespace grapnel::test {
namespace {

constexpr int kFrames = 5;

/// The site's scene as a recording: the sensor's noise differs from frame to frame.
void record_scene(const Site& site) {
  const Scene scene = load_scene(site.folder() / "scene.toml");
  CameraFile camera;
  camera.width = scene.camera.width;
  camera.height = scene.camera.height;
  camera.fx = scene.camera.fx;
  camera.fy = scene.camera.fy;
  camera.cx = scene.camera.cx;
  camera.cy = scene.camera.cy;
  RecordingWriter writer(site.folder() / "recording", camera);
  SceneRenderer renderer(scene);
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(camera.width) *
                                   static_cast<std::size_t>(camera.height));
  constexpr std::int64_t kIntervalUs = 33'333;
  for (int n = 0; n < kFrames; ++n) {
    renderer.render(n, {depth.data(), camera.width, camera.height}, {});
    writer.add_depth((n + 1) * kIntervalUs, {depth.data(), camera.width, camera.height});
  }
}

/// The result's registers, objects and floats included, without what is a time.
std::vector<std::uint16_t> report_of(Plc& plc) {
  namespace r = registers::result;
  const std::set<std::size_t> times = {r::kCaptureDelayUs, r::kCaptureDelayUs + 1u,
                                       r::kAgeUs,          r::kAgeUs + 1u,
                                       r::kTTotalUs,       r::kTTotalUs + 1u};
  std::vector<std::uint16_t> report;
  const auto read = [&](std::size_t first, std::size_t count) {
    std::vector<std::uint16_t> words(count);
    EXPECT_TRUE(plc.client().read_input(static_cast<std::uint16_t>(first),
                                        static_cast<std::uint16_t>(count), words.data()));
    for (std::size_t i = 0; i < count; ++i) {
      if (times.count(first + i) == 0) report.push_back(words[i]);
    }
  };
  read(r::kFirst, r::kLast - r::kFirst + 1u);
  read(200, 80);
  read(700, 32);
  return report;
}

/// One result a frame of the recording.
std::vector<std::vector<std::uint16_t>> play(const Site& site, const std::string& simd) {
  DaemonProcess::Options options;
  if (!simd.empty()) options.arguments = {"--simd", simd};
  DaemonProcess daemon(site, options);
  EXPECT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  std::vector<std::vector<std::uint16_t>> reports;
  for (std::uint32_t i = 0; i < kFrames; ++i) {
    const PlcAnswer answer =
        plc.send(PlcCommandCode::Register, {.timeout_ms = 20'000, .enc_trigger = i, .part_tag = i});
    EXPECT_EQ(answer.reading.result.frame_id, i) << "a job took another frame than its own";
    EXPECT_EQ(answer.reading.result.code, Code::ObjectFound);
    reports.push_back(report_of(plc));
  }
  // Beyond the recording's end there is nothing to find a part in.
  EXPECT_EQ(plc.send(PlcCommandCode::Register).reading.result.code, Code::NoFrameInTime);
  return reports;
}

TEST(Determinism, TwoRunsOfARecordingAndEverySimdTargetGiveTheSameReports) {
  const Site site;
  record_scene(site);
  std::string config = Site::config_text(10);
  const std::string camera = "driver = \"synthetic\"\nscene = \"scene.toml\"\nloop = true\n";
  const std::size_t at = config.find(camera);
  ASSERT_NE(at, std::string::npos);
  config.replace(at, camera.size(),
                 "driver = \"replay\"\npath = \"recording\"\nmode = \"stepped\"\n");
  site.write("grapnel.toml", config);
  const auto first = play(site, "");
  ASSERT_EQ(first.size(), static_cast<std::size_t>(kFrames));
  EXPECT_NE(first[0], first[1]) << "the frames are alike: nothing is shown";
  EXPECT_EQ(play(site, ""), first);
  for (const char* target : {"SSE2", "SSSE3", "SSE4", "AVX2", "AVX3"}) {
    const Finished known =
        run_grapneld({"--config", site.config().string(), "--check", "--simd", target});
    if (known.status == 0) {
      EXPECT_EQ(play(site, target), first) << target;
    }
  }
}

}  // namespace
}  // namespace grapnel::test
