#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace grapnel::test {

/// The power of a disk: counts this program's calls of write, rename, fsync and syncfs on files
/// below a folder, and cuts it after one of them. What is called later never reaches the disk.
class PowerSwitch {
 public:
  /// What a disk may have lost of what was not synced.
  enum class Loss {
    Nothing,  ///< the process was killed, no more
    Data,     ///< the second half of what was written
    Names,    ///< that, and every renaming
  };

  PowerSwitch(std::filesystem::path folder, int calls);
  PowerSwitch(const PowerSwitch&) = delete;
  PowerSwitch& operator=(const PowerSwitch&) = delete;
  ~PowerSwitch();

  [[nodiscard]] bool cut() const { return cut_; }
  [[nodiscard]] const std::string& last_call() const { return last_call_; }
  /// Leaves on the disk what such a cut leaves. Once.
  void lose(Loss loss);

  // For the calls themselves.
  void wrote(const std::string& path, std::uintmax_t before);
  void renamed(const std::string& from, const std::string& to);
  void synced(const std::string& path);
  void synced_all();
  [[nodiscard]] bool watches(const std::string& path) const;

 private:
  void end(const char* call);

  std::string folder_;
  int left_;
  bool cut_ = false;
  std::string last_call_;
  std::map<std::string, std::uintmax_t> unsynced_;  // bytes that are safe
  std::vector<std::pair<std::string, std::string>> names_;
};

}  // namespace grapnel::test
