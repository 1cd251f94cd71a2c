#pragma once

#include <string>

namespace grapnel::bench {

// Each prints one part of the table; the names are those of the command line.

void print_filters();
void print_keypoints();
void print_features();
void print_registration();
/// Frame to pose on simulated frames.
void print_frames();
/// Pairs of recorded views, where GRAPNEL_DATA names them, by us and by the peers' whole chains.
void print_pairs();
/// One frame with this shipped preset, for counting instructions; false when there is none.
[[nodiscard]] bool run_one_frame(const std::string& preset);
/// The same with two views of "bunny" or "kitchen"; false where they are not there.
[[nodiscard]] bool run_one_pair(const std::string& name, int source, int target);
/// Cost by number of points.
void print_growth();

}  // namespace grapnel::bench
