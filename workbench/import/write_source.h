#pragma once

#include <optional>
#include <string>

#include "drivers/replay/recording_writer.h"
#include "workbench/import/source.h"

namespace grapnel {

/// The camera to write for a source: the one of file `given`, the source's own, or a nominal one;
/// source.camera_origin says which. Throws InputError.
[[nodiscard]] CameraFile choose_camera(Source& source, const std::optional<std::string>& given);

/// Writes every frame of the source. Decodes every image once, so that what is imported is known to
/// be readable. Throws InputError.
void write_source(Source& source, const CameraFile& camera, bool with_color,
                  RecordingWriter& writer);

}  // namespace grapnel
