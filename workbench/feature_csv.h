#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/features.h"

namespace grapnel {

/// Rows as `grapnel describe` writes them: the index of a point, then its bins.
struct FeatureTable {
  std::vector<std::int64_t> index;
  std::vector<float> bins;  ///< rows × dimension
  std::size_t dimension = 0;

  [[nodiscard]] std::size_t rows() const noexcept { return index.size(); }
};

/// Throws InputError with file and line.
[[nodiscard]] FeatureTable load_feature_csv(const std::filesystem::path& file);

/// Pairs out of a file: JSON with `correspondences` as `grapnel match` prints it, or lines
/// source,target,distance. Throws InputError.
[[nodiscard]] std::vector<Correspondence> load_correspondences(const std::filesystem::path& file);

/// {"correspondences": [{source, target, distance}]} on stdout, or lines of the three.
void print_correspondences(const std::vector<Correspondence>& pairs, bool json);

}  // namespace grapnel
