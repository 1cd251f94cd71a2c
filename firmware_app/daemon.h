#pragma once

#include "firmware_app/options.h"
#include "firmware_app/settings.h"

namespace grapnel {

/// Runs the appliance until SIGTERM or SIGINT. Exit status 0, or 1 with one line on stderr when it
/// could not start or go on.
[[nodiscard]] int run_daemon(const DaemonOptions& options);

/// Version as --version and device identification say it.
[[nodiscard]] const char* version_text() noexcept;

}  // namespace grapnel
