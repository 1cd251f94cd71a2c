#include "base/running_stage.h"

namespace grapnel {
namespace {

thread_local std::atomic<Stage>* t_place = nullptr;

}  // namespace

void note_stages_in(std::atomic<Stage>* place) noexcept { t_place = place; }

void note_stage(Stage stage) noexcept {
  if (t_place != nullptr) t_place->store(stage, std::memory_order_relaxed);
}

}  // namespace grapnel
