#pragma once

#include <string>

namespace grapnel::bench {

// Each prints one part of the table; the names are those of the command line.

void print_filters();
void print_keypoints();
void print_features();
void print_registration();
/// Frame to pose on simulated frames, and on recorded ones where GRAPNEL_DATA names them.
void print_frames();
/// One frame with this shipped preset, for counting instructions; false when there is none.
[[nodiscard]] bool run_one_frame(const std::string& preset);
/// Cost by number of points.
void print_growth();

}  // namespace grapnel::bench
