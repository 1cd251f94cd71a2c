#include "firmware_app/snapshot.h"

#include <charconv>
#include <cstring>
#include <map>
#include <optional>
#include <string_view>

#include "base/config.h"
#include "base/config_text.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "firmware_app/durable_file.h"

namespace grapnel {
namespace {

constexpr int kVersion = 1;

// The file is a list of named parts: u64 length of the name, name, u64 length, bytes.
using Parts = std::map<std::string, std::vector<std::byte>>;

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void append_block(std::vector<std::byte>& out, std::span<const std::byte> block) {
  const std::uint64_t size = block.size();
  const auto head = std::as_bytes(std::span(&size, 1));
  out.insert(out.end(), head.begin(), head.end());
  out.insert(out.end(), block.begin(), block.end());
}

std::span<const std::byte> take_block(std::span<const std::byte>& rest, const std::string& name) {
  std::uint64_t size = 0;
  if (rest.size() < sizeof size) throw InputError(name + ": cut short");
  std::memcpy(&size, rest.data(), sizeof size);
  rest = rest.subspan(sizeof size);
  if (size > rest.size()) throw InputError(name + ": cut short");
  const auto block = rest.first(static_cast<std::size_t>(size));
  rest = rest.subspan(block.size());
  return block;
}

/// "key = value" lines of TOML.
class Table {
 public:
  void number(const char* key, double value) { text_ += key + (" = " + real_text(value)) + "\n"; }
  void integer(const char* key, std::int64_t value) {
    text_ += key + (" = " + std::to_string(value)) + "\n";
  }
  void flag(const char* key, bool value) {
    text_ += std::string(key) + (value ? " = true\n" : " = false\n");
  }
  void words(const char* key, const std::vector<std::string>& values) {
    text_ += std::string(key) + " = [";
    for (const std::string& value : values) text_ += quoted_text(value) + ", ";
    text_ += "]\n";
  }
  void word(const char* key, const std::string& value) {
    text_ += std::string(key) + " = " + quoted_text(value) + "\n";
  }
  template <class Derived>
  void matrix(const char* key, const Eigen::MatrixBase<Derived>& values) {
    text_ += std::string(key) + " = [";
    for (Eigen::Index row = 0; row < values.rows(); ++row) {
      for (Eigen::Index column = 0; column < values.cols(); ++column) {
        text_ += real_text(values(row, column)) + ", ";
      }
    }
    text_ += "]\n";
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string hex(std::uint64_t value) {
  char digits[17] = {};
  const auto end = std::to_chars(digits, digits + 16, value, 16);
  return {digits, end.ptr};
}

std::string job_text(const Snapshot& snapshot) {
  const JobEvidence& job = snapshot.evidence;
  const DepthFrame& frame = job.frame;
  const JobContext& context = job.context;
  Table table;
  table.integer("version", kVersion);
  table.word("build", snapshot.build);
  table.word("simd", snapshot.simd);
  table.word("label", name_of(job.label));
  table.integer("job", job.job);
  table.integer("command", job.command.code);
  table.integer("token", job.command.seq);
  table.integer("part_tag", job.command.part_tag);
  table.integer("encoder", job.command.enc_trigger);
  table.integer("code", static_cast<int>(job.result.code));
  table.integer("retries", job.result.retries);
  table.integer("age_us", job.result.age_us);
  table.integer("total_us", job.result.total_us);
  const Intrinsics& k = frame.intrinsics;
  table.matrix("intrinsics", Eigen::RowVector4d(k.fx, k.fy, k.cx, k.cy));
  table.number("metres_per_unit", frame.metres_per_unit);
  table.number("baseline_m", frame.baseline_m);
  table.integer("exposure_us", frame.exposure_us);
  table.integer("device_us", frame.device_us);
  table.integer("sequence", static_cast<std::int64_t>(frame.sequence));
  table.integer("lost_packets", frame.lost_packets);
  table.flag("recorded", frame.recorded);
  table.integer("model_mask", context.model_mask);
  table.integer("max_objects", context.max_objects);
  if (context.has_last_pick) table.matrix("last_pick", context.last_pick.matrix());
  if (context.has_initial) table.matrix("initial", context.initial.matrix());
  if (context.background.has_plane) {
    table.matrix("plane_normal", context.background.plane_normal.transpose());
    table.number("plane_offset_m", context.background.plane_offset_m);
  }
  table.word("preset", snapshot.preset.file);
  table.words("overrides", snapshot.preset.overrides);
  table.word("models_folder", snapshot.preset.models_folder);
  std::vector<std::string> models;
  for (const SnapshotModel& model : snapshot.preset.models) {
    models.push_back(hex(model.hash) + " " + model.name);
  }
  table.words("models", models);
  return table.text();
}

Pose take_pose(ConfigReader& reader, const char* key) {
  const std::vector<double> rows = reader.take_numbers(key, 16);
  Pose pose = Pose::Identity();
  for (int i = 0; i < 16; ++i) pose.matrix()(i / 4, i % 4) = rows[static_cast<std::size_t>(i)];
  constexpr double kRigidTolerance = 1e-5;
  if (!is_rigid(pose.matrix(), kRigidTolerance)) {
    throw reader.problem(key,
                         "not a rigid motion; a rotation, a translation and 0 0 0 1 are allowed");
  }
  return pose;
}

constexpr std::int64_t kAny32 = 0xffffffffLL;
constexpr std::int64_t kAny64 = INT64_MAX;

void read_frame(ConfigReader& reader, DepthFrame& frame) {
  reader.require("intrinsics");
  const std::vector<double> k = reader.take_numbers("intrinsics", 4);
  frame.intrinsics = {frame.depth.width, frame.depth.height, k.at(0), k.at(1), k.at(2), k.at(3)};
  if (!frame.intrinsics.valid()) {
    throw reader.problem("intrinsics",
                         "fx and fy above 0, and whole numbers of pixels are allowed");
  }
  frame.metres_per_unit = reader.take_number("metres_per_unit", 1e-9, 1.0, 0.001);
  frame.baseline_m = reader.take_number("baseline_m", 0.0, 10.0, 0.0);
  frame.exposure_us = reader.take_integer("exposure_us", INT64_MIN, kAny64, 0);
  frame.device_us = reader.take_integer("device_us", INT64_MIN, kAny64, 0);
  frame.sequence =
      static_cast<std::uint64_t>(reader.take_integer("sequence", INT64_MIN, kAny64, 0));
  frame.lost_packets =
      static_cast<std::uint32_t>(reader.take_integer("lost_packets", 0, kAny32, 0));
  frame.recorded = reader.take_bool("recorded", false);
}

void read_context(ConfigReader& reader, JobContext& context) {
  context.model_mask =
      static_cast<std::uint32_t>(reader.take_integer("model_mask", 0, kAny32, kAny32));
  context.max_objects = static_cast<std::uint16_t>(reader.take_integer("max_objects", 0, 8, 0));
  context.has_last_pick = reader.has("last_pick");
  if (context.has_last_pick) context.last_pick = take_pose(reader, "last_pick");
  context.has_initial = reader.has("initial");
  if (context.has_initial) context.initial = take_pose(reader, "initial");
  BeltBackground& background = context.background;
  background.has_plane = reader.has("plane_normal");
  if (!background.has_plane) return;
  const std::vector<double> n = reader.take_numbers("plane_normal", 3);
  background.plane_normal = Vec3d(n.at(0), n.at(1), n.at(2));
  background.plane_offset_m = reader.take_number("plane_offset_m", -1e6, 1e6, 0.0);
}

void read_preset(ConfigReader& reader, PresetOrigin& preset) {
  preset.file = reader.take_text("preset", "");
  preset.overrides = reader.take_texts("overrides");
  preset.models_folder = reader.take_text("models_folder", "");
  for (const std::string& line : reader.take_texts("models")) {
    SnapshotModel model;
    const char* const end = line.data() + line.size();
    const char* const after = std::from_chars(line.data(), end, model.hash, 16).ptr;
    if (after != end) model.name.assign(after + 1, end);
    preset.models.push_back(std::move(model));
  }
}

void read_job(const std::string& text, const std::string& name, Snapshot& snapshot) {
  const ConfigTable table = parse_config(text, name);
  ConfigReader reader(table);
  (void)reader.take_integer("version", kVersion, kVersion, kVersion);
  snapshot.build = reader.take_text("build", "");
  snapshot.simd = reader.take_text("simd", "");
  JobEvidence& job = snapshot.evidence;
  const std::string label = reader.take_text("label", "none");
  for (const GraspLabel each : {GraspLabel::Good, GraspLabel::Bad}) {
    if (label == name_of(each)) job.label = each;
  }
  const auto small = [&](const char* key, std::int64_t limit) {
    return static_cast<std::uint32_t>(reader.take_integer(key, 0, limit, 0));
  };
  job.job = small("job", kAny32);
  job.command.code = static_cast<std::uint16_t>(small("command", 0xffff));
  job.command.seq = static_cast<std::uint16_t>(small("token", 0xffff));
  job.command.part_tag = small("part_tag", kAny32);
  job.command.enc_trigger = small("encoder", kAny32);
  job.result.code = static_cast<Code>(small("code", 0xffff));
  job.result.retries = static_cast<std::uint16_t>(small("retries", 0xffff));
  job.result.age_us = small("age_us", kAny32);
  job.result.total_us = small("total_us", kAny32);
  read_frame(reader, job.frame);
  read_context(reader, job.context);
  read_preset(reader, snapshot.preset);
  reader.finish();
}

void read_images(const Parts& parts, const std::string& name, Snapshot& snapshot) {
  JobEvidence& job = snapshot.evidence;
  const auto depth_of = [&](const char* part, std::vector<std::uint16_t>& pixels) {
    const auto found = parts.find(part);
    if (found == parts.end()) return ImageView<const std::uint16_t>{};
    DepthImage image = decode_depth_png(found->second, name + ": " + part);
    pixels = std::move(image.pixels);
    return ImageView<const std::uint16_t>{pixels.data(), image.width, image.height};
  };
  job.frame.depth = depth_of("depth.png", snapshot.depth);
  if (job.frame.depth.empty()) throw InputError(name + ": holds no depth image");
  job.context.background.depth = depth_of("background.png", snapshot.background);
  const auto check_size = [&](const char* part, int width, int height) {
    if (width == job.frame.depth.width && height == job.frame.depth.height) return;
    throw InputError(name + ": " + part + ": " + std::to_string(width) + " by " +
                     std::to_string(height) + " pixels; the frame has " +
                     std::to_string(job.frame.depth.width) + " by " +
                     std::to_string(job.frame.depth.height));
  };
  const BeltBackground& belt = job.context.background;
  if (!belt.depth.empty()) check_size("background.png", belt.depth.width, belt.depth.height);
  const auto color = parts.find("color.png");
  if (color == parts.end()) return;
  ColorImage image = decode_color_image(color->second, name + ": color.png");
  check_size("color.png", image.width, image.height);
  snapshot.color = std::move(image.pixels);
  job.frame.color = {snapshot.color.data(), image.width, image.height};
}

}  // namespace

const char* name_of(GraspLabel label) noexcept {
  if (label == GraspLabel::None) return "none";
  return label == GraspLabel::Good ? "good" : "bad";
}

std::vector<std::byte> encode_snapshot(const Snapshot& snapshot) {
  Parts parts;
  const JobEvidence& job = snapshot.evidence;
  parts["job.toml"] = bytes_of(job_text(snapshot));
  parts["preset.toml"] = bytes_of(snapshot.preset.text);
  parts["grapnel.toml"] = bytes_of(snapshot.preset.config);
  parts["report.txt"] = bytes_of(snapshot.report);
  parts["log.txt"] = bytes_of(snapshot.log);
  parts["depth.png"] = encode_depth_png(job.frame.depth);
  if (!job.frame.color.empty()) parts["color.png"] = encode_color_png(job.frame.color);
  const BeltBackground& background = job.context.background;
  if (!background.depth.empty()) parts["background.png"] = encode_depth_png(background.depth);
  std::vector<std::byte> content;
  for (const auto& [name, bytes] : parts) {
    append_block(content, std::as_bytes(std::span(name)));
    append_block(content, bytes);
  }
  return content;
}

void write_snapshot(const std::filesystem::path& file, const Snapshot& snapshot) {
  write_durable(file, encode_snapshot(snapshot));
}

Snapshot read_snapshot(const std::filesystem::path& file) {
  const std::string name = file.string();
  const std::optional<std::vector<std::byte>> content = read_durable(file);
  if (!content) throw InputError(name + ": is not there");
  return parse_snapshot(*content, name);
}

Snapshot parse_snapshot(std::span<const std::byte> bytes_of_file, const std::string& name) {
  Parts parts;
  std::span<const std::byte> rest = bytes_of_file;
  while (!rest.empty()) {
    const auto part = take_block(rest, name);
    const std::string key(reinterpret_cast<const char*>(part.data()), part.size());
    const auto bytes = take_block(rest, name);
    parts[key].assign(bytes.begin(), bytes.end());
  }
  Snapshot snapshot;
  read_images(parts, name, snapshot);
  read_job(text_of(parts["job.toml"]), name + ": job.toml", snapshot);
  snapshot.preset.text = text_of(parts["preset.toml"]);
  snapshot.preset.config = text_of(parts["grapnel.toml"]);
  snapshot.report = text_of(parts["report.txt"]);
  snapshot.log = text_of(parts["log.txt"]);
  return snapshot;
}

}  // namespace grapnel
