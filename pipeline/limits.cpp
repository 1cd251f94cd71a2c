#include "pipeline/limits.h"

#include <array>

namespace grapnel {

FieldTable limits_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&Limits::max_width>("max_width", "px", 16, 1280, "widest depth image"),
      number_field<&Limits::max_height>("max_height", "px", 16, 1024, "highest depth image"),
      number_field<&Limits::max_points>("max_points", "", 256, 200000,
                                        "points of the scene's working surface"),
      number_field<&Limits::max_input_points>("max_input_points", "", 256, 4000000,
                                              "points of an unorganised cloud as read"),
      number_field<&Limits::max_model_points>("max_model_points", "", 256, 200000,
                                              "points of a model's working surface"),
      number_field<&Limits::max_keypoints>("max_keypoints", "", 16, 20000,
                                           "keypoints kept, the strongest"),
      number_field<&Limits::max_correspondences>("max_correspondences", "", 16, 65536,
                                                 "feature correspondences"),
      number_field<&Limits::max_neighbours>("max_neighbours", "", 16, 2048,
                                            "neighbours of one point"),
      number_field<&Limits::max_hypotheses>("max_hypotheses", "", 1, 1024, "poses kept at once"),
  };
  return kFields;
}

}  // namespace grapnel
