#include "workbench/import/local_recording.h"

#include <stdlib.h>

#include <optional>
#include <system_error>

#include "base/input_error.h"
#include "workbench/import/fakenect.h"
#include "workbench/import/oni.h"
#include "workbench/import/write_source.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

/// In the folder of temporary files (TMPDIR).
fs::path make_temporary(const std::string& name) {
  std::string folder = (fs::temp_directory_path() / "grapnel-import-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) {
    throw InputError(name + ": " + folder + " can't be made to import it into");
  }
  return folder;
}

void bring_in(const std::string& name, const fs::path& folder) {
  if (is_oni(name)) {
    static_cast<void>(import_oni(name, folder, std::nullopt, true));
    return;
  }
  Source source = find_source(name, {});
  const CameraFile camera = choose_camera(source, std::nullopt);
  RecordingWriter writer(folder, camera);
  write_source(source, camera, !source.unregistered_color, writer);
}

}  // namespace

LocalRecording::LocalRecording(const std::string& name) : folder_(name) {
  if (!is_oni(name) && !is_fakenect(name)) return;
  temporary_ = make_temporary(name);
  folder_ = temporary_ / "recording";
  try {
    bring_in(name, folder_);
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(temporary_, ignored);
    throw;
  }
}

LocalRecording::~LocalRecording() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

bool is_recording_name(const std::string& name) {
  std::error_code ignored;
  return fs::is_directory(name, ignored) || (is_oni(name) && fs::is_regular_file(name, ignored));
}

}  // namespace grapnel
