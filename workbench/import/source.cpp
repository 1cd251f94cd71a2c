#include "workbench/import/source.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include "base/file.h"
#include "base/formats/text_scanner.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

constexpr std::uintmax_t kMaxMatrixBytes = 1u << 16;
// Poses are written with four to eight digits.
constexpr double kRigidTolerance = 1e-2;

bool all_digits(std::string_view text) noexcept {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::int64_t digits_at(std::string_view text, std::size_t at, std::size_t count) noexcept {
  std::int64_t value = 0;
  for (const char c : text.substr(at, count)) value = value * 10 + (c - '0');
  return value;
}

/// Days from 1970-01-01 in the Gregorian calendar (Hinnant, "chrono-compatible low-level date
/// algorithms", days_from_civil).
std::int64_t days_since_1970(std::int64_t year, std::int64_t month, std::int64_t day) noexcept {
  year -= month <= 2 ? 1 : 0;
  const std::int64_t era = year / 400;
  const std::int64_t year_of_era = year - era * 400;
  const std::int64_t day_of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  const std::int64_t day_of_era =
      year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
  return era * 146097 + day_of_era - 719468;
}

std::string importable_below(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
    if (!entry.is_directory()) continue;
    for (const auto find : {&find_tum, &find_fakenect, &find_numbered, &find_tiff}) {
      try {
        if (!find(entry.path(), {})) continue;
      } catch (const InputError&) {
        continue;
      }
      names.push_back(entry.path().filename().string());
      break;
    }
  }
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

Source find_source(const std::filesystem::path& path, const SourceOptions& options) {
  if (!std::filesystem::exists(path)) throw InputError(path.string() + ": is not there");
  for (const auto find : {&find_tum, &find_fakenect, &find_numbered, &find_tiff, &find_clouds}) {
    std::optional<Source> source = find(path, options);
    if (!source) continue;
    if (source->frames.empty()) {
      throw InputError(path.string() + ": " + source->layout + ", but none of its " +
                       std::to_string(source->left_out) + " depth images can be used");
    }
    return *std::move(source);
  }
  const std::string below = importable_below(path);
  throw InputError(path.string() +
                   ": has no layout that import knows (TUM RGB-D, fakenect, 7-Scenes, " +
                   "depth_N.png, depth/ and rgb/, TIFF pairs, organised PCD)" +
                   (below.empty() ? "" : "; below it: " + below));
}

std::vector<NumberedFile> numbered_files(const std::filesystem::path& folder,
                                         const std::string& prefix, const std::string& suffix) {
  std::vector<NumberedFile> files;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= prefix.size() + suffix.size()) continue;
    if (!name.starts_with(prefix) || !name.ends_with(suffix)) continue;
    const std::string_view middle(name.data() + prefix.size(),
                                  name.size() - prefix.size() - suffix.size());
    std::uint64_t number = 0;
    if (!all_digits(middle) || !parse_count(middle, number)) continue;
    files.push_back({number, entry.path()});
  }
  std::sort(files.begin(), files.end(),
            [](const NumberedFile& a, const NumberedFile& b) { return a.number < b.number; });
  return files;
}

std::optional<std::int64_t> time_in_name(const std::string& name) {
  constexpr std::size_t kLength = 22;  // 20121214T142255.814212
  for (std::size_t at = 0; at + kLength <= name.size(); ++at) {
    const std::string_view text(name.data() + at, kLength);
    if (text[8] != 'T' || text[15] != '.') continue;
    if (!all_digits(text.substr(0, 8)) || !all_digits(text.substr(9, 6)) ||
        !all_digits(text.substr(16))) {
      continue;
    }
    const std::int64_t days =
        days_since_1970(digits_at(text, 0, 4), digits_at(text, 4, 2), digits_at(text, 6, 2));
    const std::int64_t seconds =
        (digits_at(text, 9, 2) * 60 + digits_at(text, 11, 2)) * 60 + digits_at(text, 13, 2);
    return (days * 86400 + seconds) * 1'000'000 + digits_at(text, 16, 6);
  }
  return std::nullopt;
}

std::vector<double> read_matrix(const std::filesystem::path& file, std::size_t size) {
  const std::vector<std::byte> bytes = read_file(file, kMaxMatrixBytes);
  TextScanner scanner({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, file.string());
  std::vector<double> values;
  std::string_view word;
  while (values.size() < size * size && scanner.next_word(word)) {
    double value = 0.0;
    if (!parse_number(word, value)) throw scanner.problem(quote_word(word) + " is not a number");
    values.push_back(value);
  }
  if (values.size() < size * size) {
    throw scanner.problem(std::to_string(size * size) + " numbers are expected, " +
                          std::to_string(values.size()) + " are there");
  }
  return values;
}

std::optional<Pose> read_pose_matrix(const std::filesystem::path& file) {
  const std::vector<double> values = read_matrix(file, 4);
  Mat4d matrix;
  for (Eigen::Index row = 0; row < 4; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column) {
      matrix(row, column) = values[static_cast<std::size_t>(row * 4 + column)];
    }
  }
  if (!is_rigid(matrix, kRigidTolerance)) return std::nullopt;
  const Mat3d rotation = matrix.topLeftCorner<3, 3>();
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  pose.translation() = matrix.topRightCorner<3, 1>();
  return pose;
}

}  // namespace grapnel
