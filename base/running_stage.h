#pragma once

#include <atomic>

#include "base/error.h"

namespace grapnel {

/// Where the calling thread notes the stage it is at, so that a crash record can name it. nullptr,
/// as at first: nowhere.
void note_stages_in(std::atomic<Stage>* place) noexcept;

/// The calling thread is at this stage from here on.
void note_stage(Stage stage) noexcept;

}  // namespace grapnel
