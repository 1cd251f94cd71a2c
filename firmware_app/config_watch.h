#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace grapnel {

/// Tells when a configuration file was written or replaced. Watches the folders, so that an
/// editor's rename is seen; settles for a moment, so that a save in several steps counts once.
class ConfigWatch {
 public:
  static constexpr std::int64_t kSettleUs = 100'000;

  ConfigWatch();
  ConfigWatch(const ConfigWatch&) = delete;
  ConfigWatch& operator=(const ConfigWatch&) = delete;
  ~ConfigWatch();

  /// Watches one file ("grapnel.toml"), or every *.toml of a folder. False when the kernel refuses.
  bool watch_file(const std::filesystem::path& file);
  bool watch_folder(const std::filesystem::path& folder);

  /// Descriptor that is readable when something happened.
  [[nodiscard]] int descriptor() const noexcept { return fd_; }
  /// Reads what happened; true once, when the last change is kSettleUs old.
  [[nodiscard]] bool changed(std::int64_t now_us);

 private:
  struct Row {
    int watch = -1;
    std::string name;  ///< "" = every *.toml
  };
  bool add(const std::filesystem::path& folder, const std::string& name);
  [[nodiscard]] bool concerns(int watch, const std::string& name) const;

  int fd_ = -1;
  std::vector<Row> rows_;
  std::int64_t settle_until_us_ = -1;
};

}  // namespace grapnel
