#include "base/cloud_file.h"

#include <algorithm>
#include <string_view>

#include "base/file.h"
#include "base/input_error.h"

namespace grapnel {

CloudData parse_cloud(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()),
                              std::min<std::size_t>(bytes.size(), 4));
  if (head.starts_with("ply")) return parse_ply(bytes, name);
  return parse_pcd(bytes, name);
}

CloudData read_cloud(const std::filesystem::path& file) {
  return parse_cloud(read_file(file, kMaxCloudFileBytes), file.string());
}

MeshData read_mesh(const std::filesystem::path& file) {
  return parse_ply_mesh(read_file(file, kMaxCloudFileBytes), file.string());
}

void write_cloud(const std::filesystem::path& file, const CloudData& cloud) {
  if (file.extension() == ".pcd") return write_pcd(file, cloud);
  if (file.extension() == ".ply") return write_ply(file, cloud);
  throw InputError(file.string() + ": a cloud is written as .pcd or .ply");
}

}  // namespace grapnel
