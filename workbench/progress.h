#pragma once

#include <cstddef>
#include <mutex>
#include <string>

namespace grapnel {

/// A progress bar on stderr, drawn only on a terminal. Thread-safe.
class Progress {
 public:
  Progress(std::string what, std::size_t total);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  void step();

 private:
  void draw() const;

  std::mutex mutex_;
  std::string what_;
  std::size_t total_;
  std::size_t done_ = 0;
  bool terminal_;
};

}  // namespace grapnel
