#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "base/assert.h"
#include "base/cloud_file.h"
#include "base/file.h"
#include "base/formats/byte_order.h"
#include "base/formats/lzf.h"
#include "base/formats/text_writer.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

/// One 4-byte field of the file: floats, or integers where `reals` is null.
struct OutField {
  std::string_view name;
  const std::vector<float>* reals = nullptr;
  std::vector<std::uint32_t> integers;

  [[nodiscard]] std::uint32_t bits(std::size_t i) const noexcept {
    if (reals == nullptr) return integers[i];
    std::uint32_t word = 0;
    std::memcpy(&word, &(*reals)[i], sizeof word);
    return word;
  }
};

std::vector<std::uint32_t> pack_colors(const std::vector<Rgb8>& colors) {
  std::vector<std::uint32_t> packed;
  packed.reserve(colors.size());
  for (const Rgb8& c : colors) {
    packed.push_back(0xff000000u | (std::uint32_t{c.r} << 16) | (std::uint32_t{c.g} << 8) | c.b);
  }
  return packed;
}

std::vector<OutField> fields_of(const CloudData& cloud) {
  std::vector<OutField> fields = {{"x", &cloud.x, {}}, {"y", &cloud.y, {}}, {"z", &cloud.z, {}}};
  if (cloud.has_normals()) {
    fields.push_back({"normal_x", &cloud.nx, {}});
    fields.push_back({"normal_y", &cloud.ny, {}});
    fields.push_back({"normal_z", &cloud.nz, {}});
  }
  if (cloud.has_curvature()) fields.push_back({"curvature", &cloud.curvature, {}});
  if (cloud.has_intensity()) fields.push_back({"intensity", &cloud.intensity, {}});
  if (cloud.has_color()) fields.push_back({"rgba", nullptr, pack_colors(cloud.color)});
  if (!cloud.label.empty()) fields.push_back({"label", nullptr, cloud.label});
  for (const OutField& field : fields) {
    GRAPNEL_ASSERT((field.reals != nullptr ? field.reals->size() : field.integers.size()) ==
                   cloud.size());
  }
  return fields;
}

std::string viewpoint_text(const Pose& pose) {
  const Eigen::Quaterniond rotation(pose.linear());
  std::string text;
  for (const double value : {pose.translation().x(), pose.translation().y(), pose.translation().z(),
                             rotation.w(), rotation.x(), rotation.y(), rotation.z()}) {
    text += ' ';
    append_number(text, value);
  }
  return text;
}

std::string header_text(const CloudData& cloud, const std::vector<OutField>& fields,
                        std::string_view data) {
  std::string names = "FIELDS";
  std::string sizes = "SIZE";
  std::string types = "TYPE";
  std::string counts = "COUNT";
  for (const OutField& field : fields) {
    names += ' ';
    names += field.name;
    sizes += " 4";
    types += field.reals != nullptr ? " F" : " U";
    counts += " 1";
  }
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n" + names + "\n" + sizes + "\n" +
         types + "\n" + counts + "\nWIDTH " + std::to_string(cloud.width) + "\nHEIGHT " +
         std::to_string(cloud.height) + "\nVIEWPOINT" + viewpoint_text(cloud.world_from_sensor) +
         "\nPOINTS " + std::to_string(cloud.size()) + "\nDATA " + std::string(data) + "\n";
}

std::string ascii_body(const std::vector<OutField>& fields, std::size_t points) {
  std::string text;
  for (std::size_t i = 0; i < points; ++i) {
    for (const OutField& field : fields) {
      if (&field != fields.data()) text += ' ';
      if (field.reals != nullptr) {
        append_number(text, (*field.reals)[i]);
      } else {
        text += std::to_string(field.integers[i]);
      }
    }
    text += '\n';
  }
  return text;
}

void append_records(std::vector<std::byte>& out, const std::vector<OutField>& fields,
                    std::size_t points) {
  out.reserve(out.size() + points * fields.size() * 4);
  for (std::size_t i = 0; i < points; ++i) {
    for (const OutField& field : fields) append(out, field.bits(i));
  }
}

void append_compressed(std::vector<std::byte>& out, const std::vector<OutField>& fields,
                       std::size_t points, const std::filesystem::path& file) {
  std::vector<std::byte> columns;
  columns.reserve(points * fields.size() * 4);
  for (const OutField& field : fields) {
    for (std::size_t i = 0; i < points; ++i) append(columns, field.bits(i));
  }
  const std::vector<std::byte> packed = lzf_compress(columns);
  constexpr std::size_t kLimit = std::numeric_limits<std::uint32_t>::max();
  if (columns.size() > kLimit || packed.size() > kLimit) {
    throw InputError(file.string() + ": too many points for a compressed PCD; use binary");
  }
  append(out, static_cast<std::uint32_t>(packed.size()));
  append(out, static_cast<std::uint32_t>(columns.size()));
  out.insert(out.end(), packed.begin(), packed.end());
}

}  // namespace

void write_pcd(const std::filesystem::path& file, const CloudData& cloud, PcdEncoding encoding) {
  const std::vector<OutField> fields = fields_of(cloud);
  std::vector<std::byte> out;
  switch (encoding) {
    case PcdEncoding::Ascii:
      append_text(out, header_text(cloud, fields, "ascii") + ascii_body(fields, cloud.size()));
      break;
    case PcdEncoding::Binary:
      append_text(out, header_text(cloud, fields, "binary"));
      append_records(out, fields, cloud.size());
      break;
    case PcdEncoding::BinaryCompressed:
      append_text(out, header_text(cloud, fields, "binary_compressed"));
      append_compressed(out, fields, cloud.size(), file);
      break;
  }
  write_file(file, out);
}

}  // namespace grapnel
