#include "workbench/progress.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace grapnel {

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)), total_(total), terminal_(isatty(STDERR_FILENO) == 1) {
  if (terminal_) draw();
}

Progress::~Progress() {
  if (terminal_) std::fputs("\r\033[K", stderr);
}

void Progress::step() {
  const std::lock_guard lock(mutex_);
  ++done_;
  if (terminal_) draw();
}

void Progress::draw() const {
  constexpr std::size_t kWidth = 40;
  const std::size_t full = total_ == 0 ? kWidth : kWidth * done_ / total_;
  const std::string bar = std::string(full, '#') + std::string(kWidth - full, '.');
  std::fprintf(stderr, "\r%s [%s] %zu/%zu", what_.c_str(), bar.c_str(), done_, total_);
  std::fflush(stderr);
}

}  // namespace grapnel
