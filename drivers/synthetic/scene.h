#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/config.h"
#include "base/geometry.h"
#include "drivers/synthetic/shapes.h"
#include "drivers/synthetic/structured_light.h"

namespace grapnel {

// World frame of a scene: z up, origin on the belt below the camera, x along the belt's motion.

/// The simulated sensor: it looks down on the belt, its image's u axis along the belt's motion.
struct SceneCamera {
  int width = 640;
  int height = 480;
  double fx = 575.0;
  double fy = 575.0;
  double cx = 319.5;
  double cy = 239.5;
  double baseline_m = 0.075;
  double metres_per_unit = 0.001;
  double x_m = 0.0;
  double y_m = 0.0;
  double height_m = 1.1;
  double tilt_rad = 0.0;
  bool color = true;
  std::string serial = "SYNTH0001";

  [[nodiscard]] Intrinsics intrinsics() const { return {width, height, fx, fy, cx, cy}; }
  [[nodiscard]] Pose world_from_camera() const;
};

/// The conveyor. Either it runs on at `speed_m_s`, or, with a pitch, it moves on by one station at
/// a time: `dwell_frames` at rest, then `move_frames` in motion.
struct Belt {
  double speed_m_s = 0.0;
  double pitch_m = 0.0;
  int dwell_frames = 18;
  int move_frames = 18;
  int stations = 1;  ///< after the last comes the first again
  double albedo = 0.35;

  [[nodiscard]] int period_frames() const { return dwell_frames + move_frames; }
};

/// How a part lies on the belt.
enum class Resting : std::uint8_t { Upright, UpsideDown, OnSide, OnEnd };
inline constexpr std::string_view kRestingNames[] = {"upright", "upside_down", "on_side", "on_end"};

/// One thing on the belt.
struct ScenePart {
  std::string name;
  std::string model;  ///< name of the model it is an instance of; "" for clutter
  PartKind kind = PartKind::Box;
  double albedo = 0.6;
  int station = 0;
  Mesh mesh;
  Pose world_from_model = Pose::Identity();  ///< while its station is under the camera
};

/// The right answer to a trigger.
enum class Expectation : std::uint8_t {
  Accept,  ///< the part's pose
  Empty,   ///< nothing is there
  Wrong,   ///< what is there is no instance of the model
};
inline constexpr std::string_view kExpectationNames[] = {"accept", "empty", "wrong"};

/// One trigger of the line: at a station's dwell.
struct SceneEvent {
  std::string kind;   ///< what lies there, for people
  std::string model;  ///< the model that the line asks for
  Expectation expected = Expectation::Accept;
  int station = 0;
  std::string part;  ///< name of the part whose pose is the truth; "" for none
};

enum class FaultKind : std::uint8_t {
  Stall,        ///< no frames for a while
  Drop,         ///< frames lost on their way
  Torn,         ///< lower half still that of the frame before, packets lost
  AllZero,      ///< no pixel has a reading
  Disconnect,   ///< the sensor goes away; it returns after `frames`, never when that is 0
  WrongSerial,  ///< as Disconnect, but another unit answers when it returns
  ClockWrap,    ///< the device's 32-bit clock passes its end at this frame
};
inline constexpr std::string_view kFaultKindNames[] = {
    "stall", "drop", "torn", "all_zero", "disconnect", "wrong_serial", "clock_wrap"};

/// A scripted fault from frame `at_frame` on, for `frames` frame times.
struct SceneFault {
  FaultKind kind = FaultKind::Drop;
  std::int64_t at_frame = 0;
  std::int64_t frames = 1;
};

/// A conveyor under a depth camera, as SCENE.toml describes it.
struct Scene {
  std::string name = "scene";
  std::uint64_t seed = 1;
  std::int64_t frames = 30;
  double rate_hz = 30.0;
  SceneCamera camera;
  Belt belt;
  StructuredLightParams sensor;
  std::vector<ScenePart> parts;
  std::vector<SceneEvent> events;
  std::vector<SceneFault> faults;
};

/// Reads SCENE.toml; meshes are looked for beside it. Throws InputError.
[[nodiscard]] Scene load_scene(const std::filesystem::path& file);
/// The same from a table; meshes are looked for in `folder`.
[[nodiscard]] Scene read_scene(const ConfigTable& root, const std::filesystem::path& folder);

/// Rests a mesh on the belt, turned by `yaw_rad` about the vertical.
[[nodiscard]] Pose rest_on_belt(const Mesh& mesh, Resting resting, double x_m, double y_m,
                                double yaw_rad);

/// How far the belt has moved since frame 0.
[[nodiscard]] double belt_travel_m(const Scene& scene, std::int64_t frame);
/// Where a part is at a frame. With stations, parts come round again.
[[nodiscard]] Pose world_from_part(const Scene& scene, const ScenePart& part, std::int64_t frame);
/// First frame of a station's first dwell.
[[nodiscard]] std::int64_t first_dwell_frame(const Scene& scene, int station);

}  // namespace grapnel
