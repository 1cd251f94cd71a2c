#include "drivers/replay/camera_file.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {

FieldTable CameraFile::fields() noexcept {
  using C = CameraFile;
  static constexpr std::array kFields = {
      number_field<&C::width>("width", "px", 8, 8192, "columns of the depth image"),
      number_field<&C::height>("height", "px", 8, 8192, "rows of the depth image"),
      number_field<&C::fx>("fx", "px", 1.0, 1e5, "focal length along a row"),
      number_field<&C::fy>("fy", "px", 1.0, 1e5, "focal length along a column"),
      number_field<&C::cx>("cx", "px", -1e5, 1e5,
                           "principal point, column; pixel centres are whole"),
      number_field<&C::cy>("cy", "px", -1e5, 1e5, "principal point, row"),
      number_field<&C::metres_per_unit>("metres_per_unit", "m", 1e-7, 1.0, "depth of one count"),
      numbers_field<&C::distortion>("distortion", "", -100.0, 100.0,
                                    "k1 k2 p1 p2 k3 of Brown's model; empty: none"),
      number_field<&C::baseline_m>("baseline_m", "m", 0.0, 10.0, "projector to camera"),
      numbers_field<&C::invalid>("invalid", "", 0.0, 65535.0,
                                 "counts that mean no reading, beside 0"),
      text_field<&C::serial>("serial", "of the sensor"),
  };
  return kFields;
}

CameraFile parse_camera_file(const ConfigTable& table) {
  CameraFile camera;
  ConfigReader reader(table);
  for (const char* key : {"width", "height", "fx", "fy", "cx", "cy", "metres_per_unit"}) {
    reader.require(key);
  }
  reader.take_fields(CameraFile::fields(), &camera);
  reader.finish();
  if (camera.distortion.size() > 5) {
    throw reader.problem("distortion", std::to_string(camera.distortion.size()) +
                                           " numbers are not allowed; at most 5 are");
  }
  for (const double count : camera.invalid) {
    if (count != std::floor(count)) {
      throw reader.problem("invalid", "a whole number from 0 to 65535 is allowed in the list");
    }
  }
  return camera;
}

CameraFile read_camera_file(const std::filesystem::path& file) {
  return parse_camera_file(load_config(file));
}

void erase_invalid(const CameraFile& camera, std::span<std::uint16_t> depth) noexcept {
  for (const double count : camera.invalid) {
    const auto marker = static_cast<std::uint16_t>(count);
    if (marker != 0) std::replace(depth.begin(), depth.end(), marker, std::uint16_t{0});
  }
}

std::string camera_file_text(const CameraFile& camera) {
  std::string text;
  for (const Field& field : CameraFile::fields()) {
    text += field.name;
    text += " = ";
    text += field_value_text(field, &camera);
    text += "  # ";
    text += field.help;
    if (!field.unit.empty()) {
      text += ", ";
      text += field.unit;
    }
    text += '\n';
  }
  return text;
}

}  // namespace grapnel
