#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "workbench/evaluate/case_result.h"
#include "workbench/picture/rgb_image.h"

namespace grapnel {

/// One case as a picture: depth, poses, samples.
struct CasePicture {
  std::size_t result_i = 0;
  RgbImage image;
};

/// Indices of results, the worst first: false accepts, errors, positives that were rejected, then
/// by their error; equal ones keep their order.
[[nodiscard]] std::vector<std::size_t> worst_first(const std::vector<CaseResult>& results);

/// 0 false accept, 1 error, 2 missed, 3 as it should be.
[[nodiscard]] int rank_of(const CaseResult& result) noexcept;

/// Draws the worst `count` results that can be drawn (inputs are read again): every kind of outcome
/// gets its share, so that right answers show beside wrong ones. `case_of` gives a result's case,
/// `panel_px` the longer side of each of a picture's panels.
[[nodiscard]] std::vector<CasePicture> draw_cases(const std::vector<CaseResult>& results,
                                                  const std::vector<const SuiteCase*>& case_of,
                                                  std::size_t count, int panel_px);

}  // namespace grapnel
