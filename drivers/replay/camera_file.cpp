#include "drivers/replay/camera_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace grapnel {
namespace {

void check_correction(const CameraFile& camera, const ConfigReader& reader) {
  const auto count_is = [&](const char* key, std::size_t count, std::size_t wanted) {
    if (count == wanted) return;
    throw reader.problem(key, std::to_string(count) + " numbers are not allowed; " +
                                  std::to_string(wanted) + " are");
  };
  if (!camera.ir_shift_px.empty()) count_is("ir_shift_px", camera.ir_shift_px.size(), 2);
  if (!camera.disparity_law.empty()) {
    count_is("disparity_law", camera.disparity_law.size(), 2);
    if (camera.disparity_law[1] <= 0.0) {
      throw reader.problem("disparity_law", "its scale must be above 0");
    }
  }
  const std::vector<double>& distances = camera.grid_distances_m;
  const bool ascending = std::adjacent_find(distances.begin(), distances.end(),
                                            std::greater_equal<>()) == distances.end();
  if (!ascending) throw reader.problem("grid_distances_m", "they must ascend");
  if ((camera.grid_columns > 0) != (camera.grid_rows > 0)) {
    throw reader.problem("grid_rows", "grid_columns and grid_rows are given together");
  }
  if (camera.grid_columns > 0 && distances.empty()) {
    throw reader.problem("grid_distances_m", "a grid needs at least one distance");
  }
  count_is("grid_multipliers", camera.grid_multipliers.size(),
           static_cast<std::size_t>(camera.grid_columns) *
               static_cast<std::size_t>(camera.grid_rows) * distances.size());
}

}  // namespace

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
      bool_field<&C::corrected>("corrected", "the unit's calibration is in the stored images"),
      numbers_field<&C::ir_shift_px>("ir_shift_px", "px", -64.0, 64.0,
                                     "u, v from the depth image to the infrared image that fx, fy, "
                                     "cx, cy are of; empty: none"),
      numbers_field<&C::disparity_law>(
          "disparity_law", "", -10.0, 10.0,
          "offset in 1/m and scale of the true disparity: 1/z' = offset + scale/z; empty: none"),
      number_field<&C::grid_columns>("grid_columns", "", 0, 64,
                                     "of the depth multipliers; 0: none"),
      number_field<&C::grid_rows>("grid_rows", "", 0, 64, "of the depth multipliers"),
      numbers_field<&C::grid_distances_m>("grid_distances_m", "m", 0.01, 100.0,
                                          "at which the multipliers were measured, ascending"),
      numbers_field<&C::grid_multipliers>("grid_multipliers", "", 0.5, 2.0,
                                          "of the depth after the law, by distance, row, column; "
                                          "between the cells' centres linear"),
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
  check_correction(camera, reader);
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
  const CameraFile plain;
  std::string text;
  for (const Field& field : CameraFile::fields()) {
    const bool corrects = field.name.starts_with("grid_") || field.name == "ir_shift_px" ||
                          field.name == "disparity_law";
    if (corrects && field_value_text(field, &camera) == field_value_text(field, &plain)) continue;
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
