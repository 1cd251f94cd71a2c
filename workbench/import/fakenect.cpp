#include "workbench/import/fakenect.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "base/file.h"
#include "base/formats/text_scanner.h"
#include "base/input_error.h"
#include "drivers/live/kinect_law.h"
#include "workbench/import/source.h"

namespace grapnel {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
// libfreenect's fakenect/record.c writes exactly these heads.
constexpr std::string_view kDepthHead = "P5 640 480 65535\n";
constexpr std::string_view kColorHead = "P6 640 480 255\n";
constexpr std::size_t kDepthBytes = kDepthHead.size() + 2 * kPixels;
constexpr std::size_t kColorBytes = kColorHead.size() + 3 * kPixels;

/// Why the file is not one of these images; "" when it may be one.
std::string problem_of(const std::filesystem::path& file, std::string_view head,
                       std::size_t bytes) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) return "is not there";
  if (size != bytes) {
    return "has " + std::to_string(size) + " bytes; " + std::to_string(bytes) + " belong there";
  }
  std::string start(head.size(), '\0');
  std::ifstream(file, std::ios::binary).read(start.data(), static_cast<long>(start.size()));
  if (start != head) {
    return "does not begin with \"" + std::string(head.substr(0, head.size() - 1)) + "\"";
  }
  return {};
}

std::vector<std::byte> read_checked(const std::filesystem::path& file, std::string_view head,
                                    std::size_t bytes) {
  const std::string problem = problem_of(file, head, bytes);
  if (!problem.empty()) throw InputError(file.string() + ": " + problem);
  return read_file(file, bytes);
}

std::array<std::uint16_t, kKinectNoReading + 1> make_steps() {
  std::array<std::uint16_t, kKinectNoReading + 1> steps{};
  constexpr double kFarthest_mm = 10'000.0;
  for (int raw = 0; raw < kKinectNoReading; ++raw) {
    const double mm = kinect_depth_mm(raw, {});
    if (mm <= 0.0 || mm >= kFarthest_mm) continue;
    steps[static_cast<std::size_t>(raw)] =
        static_cast<std::uint16_t>(mm / (1e3 * kKinectFineUnit_m) + 0.5);
  }
  return steps;
}

/// "d-1295570133.123456-3312345.pgm": kind, seconds since 1970, device ticks.
struct ImageName {
  char kind = ' ';
  std::int64_t time_us = 0;
};

std::optional<ImageName> parse_name(std::string_view name) {
  const std::size_t second = name.rfind('-');
  if (name.size() < 4 || name[1] != '-' || second <= 2 || second == std::string_view::npos) {
    return std::nullopt;
  }
  double seconds = 0.0;
  if (!parse_number(name.substr(2, second - 2), seconds)) return std::nullopt;
  if (seconds < 0.0 || seconds > 1e11) return std::nullopt;
  const std::string_view rest = name.substr(second + 1);
  std::uint64_t ticks = 0;
  if (!parse_count(rest.substr(0, rest.find('.')), ticks)) return std::nullopt;
  const bool ending = (name[0] == 'd' && rest.ends_with(".pgm")) ||
                      (name[0] == 'r' && rest.ends_with(".ppm")) ||
                      (name[0] == 'a' && rest.ends_with(".dump"));
  if (!ending || name.find('/') != std::string_view::npos) return std::nullopt;
  return ImageName{name[0], static_cast<std::int64_t>(seconds * 1e6 + 0.5)};
}

void sort_by_time(std::vector<SourceFrame>& frames) {
  std::stable_sort(frames.begin(), frames.end(), [](const SourceFrame& a, const SourceFrame& b) {
    return a.time_us < b.time_us;
  });
}

CameraFile nominal_kinect() {
  constexpr KinectConstants kUnit;
  CameraFile camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = kUnit.reference_distance_mm / (2.0 * kUnit.reference_pixel_mm);
  camera.cx = 0.5 * kWidth;
  camera.cy = 0.5 * kHeight;
  camera.metres_per_unit = kKinectFineUnit_m;
  camera.baseline_m = 0.01 * kUnit.emitter_distance_cm;
  camera.invalid = {0.0};
  return camera;
}

}  // namespace

DepthImage read_fakenect_depth(const std::filesystem::path& file) {
  static const std::array<std::uint16_t, kKinectNoReading + 1> steps = make_steps();
  const std::vector<std::byte> bytes = read_checked(file, kDepthHead, kDepthBytes);
  DepthImage image;
  image.width = kWidth;
  image.height = kHeight;
  image.pixels.resize(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) {
    // Little-endian, unlike a PGM of other programs.
    const std::size_t at = kDepthHead.size() + 2 * i;
    const unsigned raw =
        std::to_integer<unsigned>(bytes[at]) | std::to_integer<unsigned>(bytes[at + 1]) << 8u;
    if (raw > static_cast<unsigned>(kKinectNoReading)) {
      throw InputError(file.string() + ": pixel " + std::to_string(i) + " is " +
                       std::to_string(raw) + "; 0 to 2047 is allowed, 11 bits of disparity");
    }
    image.pixels[i] = steps[raw];
  }
  return image;
}

ColorImage read_fakenect_color(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = read_checked(file, kColorHead, kColorBytes);
  ColorImage image;
  image.width = kWidth;
  image.height = kHeight;
  image.pixels.resize(kPixels);
  std::memcpy(image.pixels.data(), bytes.data() + kColorHead.size(), 3 * kPixels);
  return image;
}

bool is_fakenect(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "INDEX.txt");
}

FrameFile read_fakenect_frame(const std::filesystem::path& folder, std::size_t number) {
  const std::optional<Source> source = find_fakenect(folder, {});
  if (!source || number >= source->frames.size()) {
    const std::size_t count = source ? source->frames.size() : 0;
    throw InputError(folder.string() + ": there is no frame " + std::to_string(number) +
                     "; it has " + std::to_string(count) + ", counted from 0");
  }
  FrameFile file;
  file.camera = nominal_kinect();
  file.time_us = source->frames[number].time_us;
  file.number = number;
  file.depth = read_fakenect_depth(source->frames[number].depth).pixels;
  return file;
}

std::optional<Source> find_fakenect(const std::filesystem::path& folder,
                                    const SourceOptions& options) {
  if (!is_fakenect(folder)) return std::nullopt;
  const std::filesystem::path index = folder / "INDEX.txt";
  const std::vector<std::byte> bytes = read_file(index, kMaxIndexBytes);
  TextScanner scanner({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, index.string());
  Source source;
  source.layout = "fakenect";
  source.camera = nominal_kinect();
  source.camera_origin = "a Kinect's nominal constants, for want of the unit's: give --camera";
  source.fixed_unit = true;
  source.unregistered_color = true;
  std::string_view line;
  while (scanner.next_line(line)) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    if (line.empty()) continue;
    const std::optional<ImageName> name = parse_name(line);
    if (!name) {
      throw scanner.problem(quote_word(line) +
                            " is not a name as fakenect-record writes it: d-SECONDS-TICKS.pgm, "
                            "r-SECONDS-TICKS.ppm or a-SECONDS-TICKS.dump");
    }
    if (name->kind == 'a') continue;
    const bool depth = name->kind == 'd';
    const std::filesystem::path file = folder / line;
    const std::string problem = depth ? problem_of(file, kDepthHead, kDepthBytes)
                                      : problem_of(file, kColorHead, kColorBytes);
    if (!problem.empty() && !options.skip_damaged) {
      throw scanner.problem(std::string(line) + " " + problem + "; --skip-damaged leaves it out");
    }
    if (!problem.empty()) {
      ++source.left_out;
    } else if (depth) {
      source.frames.push_back({name->time_us, file, {}});
    } else {
      source.colors.push_back({name->time_us, {}, file});
    }
  }
  sort_by_time(source.frames);
  sort_by_time(source.colors);
  return source;
}

}  // namespace grapnel
