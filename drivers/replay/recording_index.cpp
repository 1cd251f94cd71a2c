#include "drivers/replay/recording_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <system_error>

#include "base/file.h"
#include "base/formats/text_scanner.h"
#include "base/formats/text_writer.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

// Seconds up to the year 9999, so that microseconds and a recording's laps stay far from 2^63.
constexpr std::uint64_t kMaxSeconds = 253'402'300'799;
constexpr std::int64_t kMicro = 1'000'000;

bool inside(std::string_view file) noexcept {
  const std::filesystem::path path(file);
  if (path.is_absolute()) return false;
  return std::none_of(path.begin(), path.end(), [](const auto& part) { return part == ".."; });
}

/// Runs `take(line)` on each line that holds something; leaves out a cut last line.
template <class Take>
void for_each_row(std::string_view text, const std::string& name, Take take) {
  TextScanner scanner(text, name);
  std::string_view line;
  while (scanner.next_line(line)) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    try {
      take(scanner, line);
    } catch (const InputError&) {
      const bool cut = scanner.remaining() == 0 && text.back() != '\n';
      if (!cut) throw;
    }
  }
}

std::string_view text_of(const std::vector<std::byte>& bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

bool parse_time(std::string_view word, std::int64_t& time_us) noexcept {
  const std::size_t dot = word.find('.');
  std::uint64_t seconds = 0;
  if (!parse_count(word.substr(0, dot), seconds) || seconds > kMaxSeconds) return false;
  std::int64_t micro = 0;
  if (dot != std::string_view::npos) {
    const std::string_view digits = word.substr(dot + 1);
    std::int64_t place = kMicro;
    for (const char digit : digits) {
      if (digit < '0' || digit > '9') return false;
      place /= 10;
      micro += place * (digit - '0');
    }
    if (digits.size() > 6 && digits[6] >= '5') ++micro;
  }
  time_us = static_cast<std::int64_t>(seconds) * kMicro + micro;
  return true;
}

std::string time_text(std::int64_t time_us) {
  const std::int64_t seconds = time_us / kMicro;
  std::string micro = std::to_string(time_us % kMicro);
  micro.insert(0, 6 - micro.size(), '0');
  return std::to_string(seconds) + "." + micro;
}

std::vector<IndexRow> parse_index(std::string_view text, const std::string& name) {
  std::vector<IndexRow> rows;
  for_each_row(text, name, [&](const TextScanner& scanner, std::string_view line) {
    std::string_view time;
    std::string_view file;
    IndexRow row;
    take_word(line, time);
    if (!parse_time(time, row.time_us)) {
      throw scanner.problem(quote_word(time) + " is not a time in seconds");
    }
    if (!take_word(line, file)) throw scanner.problem("the image's file name is missing");
    if (!inside(file)) {
      throw scanner.problem(quote_word(file) + " is not allowed; a path inside the recording is");
    }
    row.file = std::string(file);
    rows.push_back(std::move(row));
  });
  return rows;
}

std::vector<IndexRow> read_index(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = read_file(file, kMaxIndexBytes);
  std::vector<IndexRow> rows = parse_index(text_of(bytes), file.string());
  const bool cut = !bytes.empty() && bytes.back() != std::byte{'\n'};
  std::error_code none;
  if (cut && !rows.empty() &&
      !std::filesystem::is_regular_file(file.parent_path() / rows.back().file, none)) {
    rows.pop_back();  // only the beginning of a name was written
  }
  return rows;
}

std::vector<TimedPose> parse_poses(std::string_view text, const std::string& name) {
  std::vector<TimedPose> poses;
  for_each_row(text, name, [&](const TextScanner& scanner, std::string_view line) {
    std::string_view word;
    TimedPose timed;
    take_word(line, word);
    if (!parse_time(word, timed.time_us)) {
      throw scanner.problem(quote_word(word) + " is not a time in seconds");
    }
    std::array<double, 7> v{};
    for (double& value : v) {
      if (!take_word(line, word) || !parse_number(word, value) || !std::isfinite(value)) {
        throw scanner.problem("a pose is: time tx ty tz qx qy qz qw");
      }
    }
    const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
    // Files round to four decimals.
    if (std::fabs(rotation.norm() - 1.0) > 0.01) {
      throw scanner.problem("the quaternion's length is not 1");
    }
    timed.pose.translation() = Vec3d(v[0], v[1], v[2]);
    timed.pose.linear() = rotation.normalized().toRotationMatrix();
    poses.push_back(timed);
  });
  return poses;
}

std::vector<TimedPose> read_poses(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = read_file(file, kMaxIndexBytes);
  return parse_poses(text_of(bytes), file.string());
}

std::string pose_line(const TimedPose& timed) {
  const Eigen::Quaterniond q(timed.pose.linear());
  const Vec3d t = timed.pose.translation();
  std::string line = time_text(timed.time_us);
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    line += ' ';
    append_number(line, value);
  }
  line += '\n';
  return line;
}

std::size_t nearest_time(const std::vector<std::int64_t>& times_us, std::int64_t time_us,
                         std::int64_t limit_us) noexcept {
  const auto after = std::lower_bound(times_us.begin(), times_us.end(), time_us);
  std::size_t best = times_us.size();
  std::int64_t best_distance_us = limit_us + 1;
  const auto consider = [&](std::vector<std::int64_t>::const_iterator at) {
    const std::int64_t distance_us = *at > time_us ? *at - time_us : time_us - *at;
    if (distance_us >= best_distance_us) return;
    best = static_cast<std::size_t>(at - times_us.begin());
    best_distance_us = distance_us;
  };
  if (after != times_us.begin()) consider(after - 1);
  if (after != times_us.end()) consider(after);
  return best;
}

}  // namespace grapnel
