#include "drivers/openni2/openni_options.h"

#include <array>

namespace grapnel {

FieldTable OpenNiOptions::fields() noexcept {
  using O = OpenNiOptions;
  static constexpr std::array kFields = {
      text_field<&O::serial>("serial", "serial number of the unit to open; \"\" opens any"),
      text_field<&O::uri>("uri", "OpenNI's name of the device's place; \"\" opens any"),
      number_field<&O::width>("width", "px", 16.0, 4096.0, "of the depth image"),
      number_field<&O::height>("height", "px", 16.0, 4096.0, "of the depth image"),
      number_field<&O::rate_hz>("rate_hz", "Hz", 1.0, 240.0, "frames a second"),
      bool_field<&O::color>("color", "stream colour too, registered to the depth's pixels"),
      number_field<&O::fx>("fx", "px", 0.0, 1e5, "calibrated; 0: by the field of view"),
      number_field<&O::fy>("fy", "px", 0.0, 1e5, "calibrated; 0: by the field of view"),
      number_field<&O::cx>("cx", "px", 0.0, 1e5, "calibrated; used when fx is given"),
      number_field<&O::cy>("cy", "px", 0.0, 1e5, "calibrated; used when fx is given"),
      text_field<&O::recording>("recording",
                                "an .oni file to play instead of a device, whole path"),
      bool_field<&O::loop>("loop", "play the recording over and over"),
      number_field<&O::baseline_m>("baseline_m", "m", 0.0, 1.0, "projector to camera"),
  };
  return kFields;
}

OpenNiOptions read_openni_options(const ConfigTable& camera) {
  OpenNiOptions options;
  ConfigReader reader(camera);
  reader.take_text("driver", "");
  reader.take_fields(OpenNiOptions::fields(), &options);
  reader.finish();
  if ((options.fx == 0.0) != (options.fy == 0.0)) {
    throw reader.problem("fy", "fx and fy are given together");
  }
  return options;
}

}  // namespace grapnel
