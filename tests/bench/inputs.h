#pragma once

#include <memory>
#include <string>

#include "base/config.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel::bench {

inline constexpr int kWidth = 640;
inline constexpr int kHeight = 480;
inline constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
inline constexpr double kFocal_px = 525.0;

/// A tilted table with a bumpy part on it, 0.7 to 1.3 m away; noise of a Kinect, 0.3 % not read.
[[nodiscard]] test::TestFrame make_frame();

/// Every `stride`-th pixel of the frame as an organised surface.
void fill(const test::TestFrame& frame, int stride, Surface& surface);

/// A wavy sheet of width × width·3/4 pixels about 1 m away with a part before it, its pitch as of a
/// decimated view, with normals and a printed pattern.
[[nodiscard]] test::OwnedSurface make_view(int width, bool on_grid);

/// A bumpy closed surface with normals and about a hundred neighbours within kRadiusRatio spacings.
[[nodiscard]] test::OwnedSurface make_ball(std::size_t points);
/// π r² / spacing² = 100 neighbours.
inline constexpr double kRadiusRatio = 5.64;

/// Ends the program when a stage that is to be measured fails.
void require(bool ok, const char* what);

/// Limits that hold a full frame.
[[nodiscard]] Limits large();

/// A method of a registry with "key=value" over its defaults.
template <class StageKind>
[[nodiscard]] std::unique_ptr<StageKind> make(const Method<StageKind>& method,
                                              const std::string& settings = "") {
  ConfigTable table("", std::string(method.name), 0);
  if (!settings.empty()) apply_override(table, settings);
  ConfigReader reader(table);
  return method.make(reader);
}

/// A stage and its memory.
template <class Stage>
struct Held {
  std::unique_ptr<Stage> stage;
  test::ArenaMemory memory;
  explicit Held(std::unique_ptr<Stage> made)
      : stage(std::move(made)), memory([this](Arena& arena) { stage->reserve(arena, large()); }) {}
};

}  // namespace grapnel::bench
