#include "workbench/pose_text.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <vector>

#include "base/input_error.h"

namespace grapnel {

std::optional<Pose> pose_from_numbers(std::span<const double> row_major) {
  // Truth files print 4 to 8 digits, so a true rotation may miss orthogonality by some 1e-4.
  constexpr double kTolerance = 1e-3;
  if (row_major.size() != 16) return std::nullopt;
  Mat4d matrix;
  for (int i = 0; i < 16; ++i) matrix(i / 4, i % 4) = row_major[static_cast<std::size_t>(i)];
  if (!matrix.allFinite() || !is_rigid(matrix, kTolerance)) return std::nullopt;
  Pose pose = Pose::Identity();
  pose.linear() =
      Eigen::Quaterniond(Mat3d(matrix.topLeftCorner<3, 3>())).normalized().toRotationMatrix();
  pose.translation() = matrix.topRightCorner<3, 1>();
  return pose;
}

Pose load_pose(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw InputError(file.string() + ": can't be opened for reading");
  std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream words(text);
  std::vector<double> numbers;
  std::string word;
  while (words >> word) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (*end != '\0') {
      throw InputError(file.string() + ": \"" + word + "\" is not a number; a pose is 16 numbers");
    }
  }
  if (numbers.size() != 16) {
    throw InputError(file.string() + ": " + std::to_string(numbers.size()) +
                     " numbers; a pose is 16 numbers, row by row");
  }
  const std::optional<Pose> pose = pose_from_numbers(numbers);
  if (!pose) {
    throw InputError(file.string() +
                     ": not a rigid motion (rotation, translation, last row 0 0 0 1)");
  }
  return *pose;
}

std::string pose_text(const Pose& pose) {
  std::string text;
  for (int row = 0; row < 4; ++row) {
    char line[128];
    const Mat4d& m = pose.matrix();
    std::snprintf(line, sizeof line, "%12.8f %12.8f %12.8f %12.8f\n", m(row, 0), m(row, 1),
                  m(row, 2), m(row, 3));
    text += line;
  }
  return text;
}

}  // namespace grapnel
