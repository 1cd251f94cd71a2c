#pragma once

#include <string>

#include "base/config.h"
#include "base/field.h"

namespace grapnel {

/// The keys of [camera] when driver = "openni2".
struct OpenNiOptions {
  std::string serial;     ///< the unit to open; "": any
  std::string uri;        ///< OpenNI's own name of the device's place; "": any
  std::string recording;  ///< .oni file; "": a device
  bool loop = false;
  int width = 640;
  int height = 480;
  int rate_hz = 30;
  bool color = true;
  double fx = 0.0;  ///< with fy, cx, cy: instead of those by the field of view; 0: these
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  double baseline_m = 0.075;

  [[nodiscard]] static FieldTable fields() noexcept;
};

/// Reads the table; `driver` is skipped. Throws InputError.
[[nodiscard]] OpenNiOptions read_openni_options(const ConfigTable& camera);

}  // namespace grapnel
