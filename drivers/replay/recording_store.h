#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace grapnel {

/// Where a recording's files go: a folder, or a test's faulty one. Names are relative to it. Every
/// call but free_bytes() throws InputError when it can't be done.
class RecordingStore {
 public:
  virtual ~RecordingStore() = default;
  virtual void make_folder(const std::string& name) = 0;
  /// The file appears whole or not at all.
  virtual void write(const std::string& name, std::span<const std::byte> bytes) = 0;
  /// Adds to the end; a failure leaves the file as it was.
  virtual void append(const std::string& name, std::string_view text) = 0;
  /// Returns when everything written so far outlasts a power cut.
  virtual void sync() = 0;
  [[nodiscard]] virtual std::uint64_t free_bytes() const noexcept = 0;
};

/// A recording's folder on a disk.
class FolderStore final : public RecordingStore {
 public:
  /// Makes the folder. Throws InputError when it can't, or when it holds a recording already.
  explicit FolderStore(std::filesystem::path folder);
  FolderStore(const FolderStore&) = delete;
  FolderStore& operator=(const FolderStore&) = delete;
  ~FolderStore() override;

  void make_folder(const std::string& name) override;
  void write(const std::string& name, std::span<const std::byte> bytes) override;
  void append(const std::string& name, std::string_view text) override;
  void sync() override;
  [[nodiscard]] std::uint64_t free_bytes() const noexcept override;

 private:
  [[nodiscard]] int open_for_append(const std::string& name);

  std::filesystem::path folder_;
  int folder_fd_ = -1;
  std::map<std::string, int> appended_;  // open files by name
};

}  // namespace grapnel
