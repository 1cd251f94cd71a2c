#include "drivers/freenect/freenect_options.h"

#include <array>
#include <string_view>

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 3> kDepths = {"mm", "raw", "registered"};

}  // namespace

FieldTable FreenectOptions::fields() noexcept {
  using O = FreenectOptions;
  static constexpr std::array kFields = {
      text_field<&O::serial>("serial", "serial number of the unit to open; \"\" opens any"),
      choice_field<&O::depth>("depth", kDepths,
                              "whole millimetres, the raw 11 bits in steps of 0.2 mm, or "
                              "millimetres in the colour camera's image"),
      bool_field<&O::color>("color", "stream colour too"),
      number_field<&O::fx>("fx", "px", 0.0, 1e5, "calibrated; 0: the device's own"),
      number_field<&O::fy>("fy", "px", 0.0, 1e5, "calibrated; 0: the device's own"),
      number_field<&O::cx>("cx", "px", 0.0, 1e5, "calibrated; used when fx is given"),
      number_field<&O::cy>("cy", "px", 0.0, 1e5, "calibrated; used when fx is given"),
  };
  return kFields;
}

FreenectOptions read_freenect_options(const ConfigTable& camera) {
  FreenectOptions options;
  ConfigReader reader(camera);
  reader.take_text("driver", "");
  reader.take_fields(FreenectOptions::fields(), &options);
  reader.finish();
  if ((options.fx == 0.0) != (options.fy == 0.0)) {
    throw reader.problem("fy", "fx and fy are given together");
  }
  return options;
}

}  // namespace grapnel
