#include "pipeline/registrar.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "base/assert.h"
#include "base/hash.h"
#include "base/input_error.h"
#include "base/rng.h"
#include "pipeline/frame_job.h"
#include "pipeline/kernels/target.h"
#include "pipeline/pair_job.h"
#include "pipeline/registrar_state.h"

namespace grapnel {

std::vector<MemoryItem> Registrar::plan(const Preset& preset) {
  RegistrarState state(preset);
  Arena measuring;
  std::vector<MemoryItem> parts;
  state.reserve(measuring, &parts);
  return parts;
}

std::size_t Registrar::required_bytes(const Preset& preset) {
  RegistrarState state(preset);
  Arena measuring;
  state.reserve(measuring, nullptr);
  return measuring.used_bytes();
}

std::unique_ptr<Registrar> Registrar::create(Preset preset, std::span<std::byte> memory) {
  auto state = std::make_unique<RegistrarState>(std::move(preset));
  Arena measuring;
  state->reserve(measuring, nullptr);
  if (memory.size() < measuring.used_bytes()) {
    throw InputError(state->preset.file.string() + ": the preset needs " +
                     std::to_string(measuring.used_bytes()) + " bytes, there are " +
                     std::to_string(memory.size()));
  }
  Arena arena(memory);
  state->reserve(arena, nullptr);
  state->used_bytes = arena.used_bytes();
  state->build_models();
  return std::unique_ptr<Registrar>(new Registrar(std::move(state)));
}

std::unique_ptr<Registrar> Registrar::create(Preset preset) {
  const std::size_t bytes = required_bytes(preset);
  auto* block = static_cast<std::byte*>(
      ::operator new[](std::max<std::size_t>(bytes, 1), std::align_val_t{Arena::kAlignment}));
  std::unique_ptr<std::byte[], RegistrarState::FreeBlock> memory(block);
  std::unique_ptr<Registrar> registrar = create(std::move(preset), {block, bytes});
  registrar->state_->own_memory = std::move(memory);
  return registrar;
}

Registrar::Registrar(std::unique_ptr<RegistrarState> state) : state_(std::move(state)) {}
Registrar::~Registrar() = default;

Result<RegistrationReports> Registrar::run(const DepthFrame& frame,
                                           const JobContext& context) noexcept {
  return FrameJob(*state_, context).run(frame);
}

Result<RegistrationReports> Registrar::run(const Surface& scene,
                                           const JobContext& context) noexcept {
  if (!scene.organised()) return Error{Code::BadParameter, Stage::Organize, 0};
  return FrameJob(*state_, context).run(scene);
}

Result<RegistrationReports> Registrar::register_pair(const Surface& source, const Surface& target,
                                                     const JobContext& context) noexcept {
  return PairJob(*state_, context).run(source, target);
}

Result<double> Registrar::occupied_share(const DepthFrame& frame,
                                         const JobContext& context) noexcept {
  return FrameJob(*state_, context).occupied_share(frame);
}

const Preset& Registrar::preset() const noexcept { return state_->preset; }
std::size_t Registrar::used_bytes() const noexcept { return state_->used_bytes; }
const char* Registrar::simd_target() noexcept { return kernels::target_name(); }
bool Registrar::force_simd_target(const std::string& name) noexcept {
  return kernels::force_target(name);
}

}  // namespace grapnel
