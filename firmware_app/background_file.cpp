#include <cstring>

#include "base/input_error.h"
#include "firmware_app/background.h"
#include "firmware_app/durable_file.h"

namespace grapnel {
namespace {

/// Head of the file; the depth counts follow, row by row.
struct Record {
  std::int32_t width = 0;
  std::int32_t height = 0;
  double metres_per_unit = 0.0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  double has_plane = 0.0;
  double plane[4] = {};
};

}  // namespace

std::vector<std::byte> Background::encode(const Image& image) const {
  Record record;
  record.width = image.width;
  record.height = image.height;
  record.metres_per_unit = image.metres_per_unit;
  record.fx = image.intrinsics.fx;
  record.fy = image.intrinsics.fy;
  record.cx = image.intrinsics.cx;
  record.cy = image.intrinsics.cy;
  record.has_plane = image.has_plane ? 1.0 : 0.0;
  for (int i = 0; i < 3; ++i) record.plane[i] = image.plane_normal(i);
  record.plane[3] = image.plane_offset_m;
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  std::vector<std::byte> bytes(sizeof record + pixels * sizeof(std::uint16_t));
  std::memcpy(bytes.data(), &record, sizeof record);
  std::memcpy(bytes.data() + sizeof record, image.depth.data(), pixels * sizeof(std::uint16_t));
  return bytes;
}

bool Background::save_if_learned(const std::filesystem::path& file) {
  const int index = to_save_.load(std::memory_order_acquire);
  if (index < 0) return false;
  const std::vector<std::byte> bytes = encode(images_[static_cast<std::size_t>(index)]);
  take_reference(images_[static_cast<std::size_t>(index)]);
  to_save_.store(-1, std::memory_order_release);
  write_durable(file, bytes);
  return true;
}

bool Background::load(const std::filesystem::path& file) {
  const std::optional<std::vector<std::byte>> bytes = read_durable(file);
  if (!bytes) return false;
  Record record;
  if (bytes->size() < sizeof record) throw InputError(file.string() + ": cut short");
  std::memcpy(&record, bytes->data(), sizeof record);
  Image& image = images_[in_use_];
  const std::size_t pixels =
      record.width > 0 && record.height > 0
          ? static_cast<std::size_t>(record.width) * static_cast<std::size_t>(record.height)
          : 0;
  if (pixels == 0 || pixels > image.depth.size() ||
      bytes->size() != sizeof record + pixels * sizeof(std::uint16_t)) {
    throw InputError(file.string() + ": an image of " + std::to_string(record.width) + " x " +
                     std::to_string(record.height) + " pixels does not fit the planned memory");
  }
  image.width = record.width;
  image.height = record.height;
  image.metres_per_unit = record.metres_per_unit;
  image.intrinsics = {record.width, record.height, record.fx, record.fy, record.cx, record.cy};
  image.has_plane = record.has_plane != 0.0;
  image.plane_normal = {record.plane[0], record.plane[1], record.plane[2]};
  image.plane_offset_m = record.plane[3];
  take_reference(image);
  std::memcpy(image.depth.data(), bytes->data() + sizeof record, pixels * sizeof(std::uint16_t));
  return true;
}

}  // namespace grapnel
