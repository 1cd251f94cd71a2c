#pragma once

#include <cstddef>
#include <memory>

#include "base/depth_frame.h"
#include "base/error.h"
#include "firmware_app/job.h"
#include "pipeline/registrar.h"
#include "pipeline/report.h"

namespace grapnel {

/// What a job asks of the pipeline. The registrar in the daemon, a fake in the tests of job logic.
class JobRunner {
 public:
  virtual ~JobRunner() = default;
  virtual Result<RegistrationReports> run(const DepthFrame& frame,
                                          const JobContext& context) noexcept = 0;
  /// Share of the region of interest that stands above the belt, 0…1.
  virtual Result<double> occupied_share(const DepthFrame& frame,
                                        const JobContext& context) noexcept = 0;
};

/// A preset in use: what the jobs need and the pipeline built for it. Made and destroyed on the
/// config thread, used on the registration thread.
struct ActivePreset {
  JobProfile profile;
  std::unique_ptr<JobRunner> runner;
  std::size_t half = 0;      ///< of the reserved block it lives in
  std::uint32_t origin = 0;  ///< FilePresetSource::origin() of it; 0: unknown
};

}  // namespace grapnel
