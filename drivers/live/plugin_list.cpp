#include "drivers/live/plugin_list.h"

#include <chrono>
#include <cstdio>
#include <exception>
#include <future>
#include <memory>
#include <utility>

namespace grapnel {

int list_in_time(std::function<std::vector<std::string>()> find, TaskLaunch launch, char* lines,
                 std::size_t bytes) {
  if (bytes > 0) lines[0] = '\0';
  try {
    using Task = std::packaged_task<std::vector<std::string>()>;
    auto owned = std::make_unique<Task>(std::move(find));
    std::future<std::vector<std::string>> answer = owned->get_future();
    // Ends with the thread that runs it, however late.
    Task* const task = owned.get();
    const auto run = [task] {
      const std::unique_ptr<Task> mine(task);
      (*mine)();
    };
    if (!launch(run)) return 0;
    static_cast<void>(owned.release());
    if (answer.wait_for(std::chrono::seconds(3)) != std::future_status::ready) return 0;
    const std::vector<std::string> found = answer.get();
    std::string text;
    for (const std::string& line : found) text += line + "\n";
    std::snprintf(lines, bytes, "%s", text.c_str());
    return static_cast<int>(found.size());
  } catch (const std::exception&) {
    return 0;
  }
}

}  // namespace grapnel
