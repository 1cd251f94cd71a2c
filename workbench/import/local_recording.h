#pragma once

#include <filesystem>
#include <string>

namespace grapnel {

/// A recording as a folder in Grapnel's layout: where it is, or, of an .oni file or a fakenect
/// folder, brought into a temporary one that goes away with this object.
class LocalRecording {
 public:
  /// Throws InputError when a foreign one can't be brought in.
  explicit LocalRecording(const std::string& name);
  LocalRecording(const LocalRecording&) = delete;
  LocalRecording& operator=(const LocalRecording&) = delete;
  ~LocalRecording();

  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  std::filesystem::path folder_;
  std::filesystem::path temporary_;  // empty: none
};

/// True when `name` is a recording, of Grapnel's layout or a foreign one, and not a single view.
[[nodiscard]] bool is_recording_name(const std::string& name);

}  // namespace grapnel
