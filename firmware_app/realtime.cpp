#include "firmware_app/realtime.h"

#include <malloc.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <climits>
#include <cstring>

#include "base/input_error.h"

namespace grapnel {

void tune_heap() noexcept {
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  constexpr int kTopPadBytes = 8 << 20;
  mallopt(M_TOP_PAD, kTopPadBytes);
}

bool lock_memory(std::string& why) {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return true;
  why = std::string("memory can't be locked: ") + std::strerror(errno) +
        " (LimitMEMLOCK=infinity or CAP_IPC_LOCK grants it)";
  return false;
}

bool schedule_this_thread(const Scheduling& scheduling) noexcept {
  bool granted = true;
  if (scheduling.cpu >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(scheduling.cpu), &set);
    granted = pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0;
  }
  if (scheduling.priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = scheduling.priority;
    granted = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0 && granted;
  }
  return granted;
}

void name_this_thread(const char* name) noexcept { pthread_setname_np(pthread_self(), name); }

void touch_stack() noexcept {
  constexpr std::size_t kTouchedBytes = Thread::kStackBytes / 2;
  constexpr std::size_t kPageBytes = 4096;
  char room[kTouchedBytes];
  volatile char* touched = room;
  for (std::size_t i = 0; i < kTouchedBytes; i += kPageBytes) touched[i] = 0;
}

bool Thread::start(Body body, void* context) {
  start_ = std::make_unique<Start>(Start{body, context});
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, kStackBytes);
  const int failed = pthread_create(
      &thread_, &attributes,
      [](void* raw) -> void* {
        const Start& start = *static_cast<const Start*>(raw);
        start.body(start.context);
        return nullptr;
      },
      start_.get());
  pthread_attr_destroy(&attributes);
  running_ = failed == 0;
  return running_;
}

void Thread::join() noexcept {
  if (running_) pthread_join(thread_, nullptr);
  running_ = false;
}

MemoryBlock::MemoryBlock(std::size_t bytes) : bytes_(bytes) {
  if (bytes == 0) return;
  void* block = mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                     MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (block == MAP_FAILED) {
    throw InputError("memory.budget_mb: " + std::to_string(bytes) +
                     " bytes can't be reserved: " + std::strerror(errno));
  }
  data_ = static_cast<std::byte*>(block);
}

MemoryBlock::~MemoryBlock() {
  if (data_ != nullptr) munmap(data_, bytes_);
}

}  // namespace grapnel
