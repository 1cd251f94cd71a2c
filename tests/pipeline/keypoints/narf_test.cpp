#include "pipeline/keypoints/narf.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

/// A detector that looks at the whole of a surface's finest image.
struct Looked {
  NarfDetector detector;
  KeypointSet keypoints;
  test::ArenaMemory memory;

  static NarfParams params(Engine engine) {
    NarfParams params;
    params.engine = engine;
    params.min_interest = 0.0;
    params.pyramid = false;
    return params;
  }
  Looked(Engine engine, const Surface& surface)
      : detector(params(engine)), memory([&](Arena& arena) {
          detector.reserve(arena, test::small_limits());
          keypoints = KeypointSet(arena.take<Keypoint>(surface.size));
        }) {
    EXPECT_TRUE(detector.detect(surface, keypoints).ok());
  }
};

TEST(NarfDetector, SeesTheSameChangesAsPlainLoopsUpToTheImagesEdge) {
  test::OwnedSurface sheet = test::wavy_grid(60, 50, 1);
  const Looked fast(Engine::Fast, *sheet);
  const Looked plain(Engine::Reference, *sheet);
  const RangeImage& image = fast.detector.image();
  ASSERT_EQ(image.width, 60);
  ASSERT_EQ(image.height, 50);
  int borders = 0;
  int other = 0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const int to_edge = std::min({u, v, image.width - 1 - u, image.height - 1 - v});
      if (to_edge >= RangeImage::kRim) continue;
      const std::size_t pixel = image.at(u, v);
      const RangeBorders& a = fast.detector.borders();
      const RangeBorders& b = plain.detector.borders();
      borders += b.obstacle(pixel) ? 1 : 0;
      const bool same = a.obstacle(pixel) == b.obstacle(pixel) &&
                        a.excluded(pixel) == b.excluded(pixel) &&
                        std::fabs(a.change(pixel) - b.change(pixel)) < 1e-3F;
      other += same ? 0 : 1;
    }
  }
  EXPECT_GT(borders, 5);
  // No score of this sheet lies on a threshold, no neighbour on the reach of a plane: there single
  // precision may fall to either side.
  EXPECT_EQ(other, 0);
}

}  // namespace
}  // namespace grapnel
