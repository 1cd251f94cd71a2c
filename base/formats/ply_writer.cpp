#include <cstdint>
#include <string>

#include "base/assert.h"
#include "base/cloud_file.h"
#include "base/file.h"
#include "base/formats/byte_order.h"
#include "base/formats/text_writer.h"

namespace grapnel {
namespace {

/// Appends values as words of a line or as bytes.
class PlySink {
 public:
  explicit PlySink(PlyEncoding encoding) : ascii_(encoding == PlyEncoding::Ascii) {}

  void header(const std::string& elements) {
    append_text(out_, "ply\nformat " + std::string(ascii_ ? "ascii" : "binary_little_endian") +
                          " 1.0\n" + elements + "end_header\n");
  }
  template <class T>
  void value(T number) {
    if (!ascii_) return append(out_, number);
    if (!line_.empty()) line_ += ' ';
    if constexpr (std::is_same_v<T, float>) {
      append_number(line_, number);
    } else {
      line_ += std::to_string(number);
    }
  }
  void color(const Rgb8& c) {
    value(c.r);
    value(c.g);
    value(c.b);
  }
  void end_row() {
    if (!ascii_) return;
    append_text(out_, line_ + "\n");
    line_.clear();
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const noexcept { return out_; }

 private:
  bool ascii_;
  std::string line_;
  std::vector<std::byte> out_;
};

constexpr const char* kPosition = "property float x\nproperty float y\nproperty float z\n";
constexpr const char* kNormal = "property float nx\nproperty float ny\nproperty float nz\n";
constexpr const char* kColor = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

}  // namespace

void write_ply(const std::filesystem::path& file, const CloudData& cloud, PlyEncoding encoding) {
  const std::size_t points = cloud.size();
  GRAPNEL_ASSERT(cloud.y.size() == points && cloud.z.size() == points);
  PlySink sink(encoding);
  std::string elements = "element vertex " + std::to_string(points) + "\n" + kPosition;
  if (cloud.has_normals()) elements += kNormal;
  if (cloud.has_color()) elements += kColor;
  if (cloud.has_curvature()) elements += "property float curvature\n";
  if (cloud.has_intensity()) elements += "property float intensity\n";
  if (!cloud.label.empty()) elements += "property uint label\n";
  sink.header(elements);
  for (std::size_t i = 0; i < points; ++i) {
    sink.value(cloud.x[i]);
    sink.value(cloud.y[i]);
    sink.value(cloud.z[i]);
    if (cloud.has_normals()) {
      sink.value(cloud.nx[i]);
      sink.value(cloud.ny[i]);
      sink.value(cloud.nz[i]);
    }
    if (cloud.has_color()) sink.color(cloud.color[i]);
    if (cloud.has_curvature()) sink.value(cloud.curvature[i]);
    if (cloud.has_intensity()) sink.value(cloud.intensity[i]);
    if (!cloud.label.empty()) sink.value(cloud.label[i]);
    sink.end_row();
  }
  write_file(file, sink.bytes());
}

void write_ply(const std::filesystem::path& file, const MeshData& mesh, PlyEncoding encoding) {
  PlySink sink(encoding);
  std::string elements =
      "element vertex " + std::to_string(mesh.vertices.size()) + "\n" + kPosition;
  if (!mesh.color.empty()) elements += kColor;
  sink.header(elements + "element face " + std::to_string(mesh.triangles.size()) +
              "\nproperty list uchar uint vertex_indices\n");
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) sink.value(mesh.vertices[i][axis]);
    if (!mesh.color.empty()) sink.color(mesh.color[i]);
    sink.end_row();
  }
  for (const auto& triangle : mesh.triangles) {
    sink.value(std::uint8_t{3});
    for (const std::uint32_t corner : triangle) sink.value(corner);
    sink.end_row();
  }
  write_file(file, sink.bytes());
}

}  // namespace grapnel
