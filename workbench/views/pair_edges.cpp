#include "workbench/views/pair_edges.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#include "base/clock.h"
#include "pipeline/registrar.h"
#include "workbench/presets.h"
#include "workbench/progress.h"

namespace grapnel {
namespace {

void raise_limits(Limits& limits, const std::vector<View>& views) {
  for (const View& view : views) {
    const Surface& surface = view.surface->surface;
    limits.max_width = std::max(limits.max_width, surface.grid.width);
    limits.max_height = std::max(limits.max_height, surface.grid.height);
    limits.max_input_points = std::max(limits.max_input_points, surface.capacity());
  }
}

std::vector<ViewEdge> pairs_within_reach(std::size_t views, std::size_t reach) {
  std::vector<ViewEdge> edges;
  for (std::size_t target = 0; target < views; ++target) {
    for (std::size_t source = target + 1; source < views; ++source) {
      if (reach > 0 && source - target > reach) break;
      ViewEdge edge;
      edge.source = source;
      edge.target = target;
      edges.push_back(edge);
    }
  }
  return edges;
}

void register_one(Registrar& registrar, const std::vector<View>& views, ViewEdge& edge) {
  const MonotonicClock clock;
  JobContext context;
  context.clock = &clock;
  const std::int64_t begin_us = clock.now_us();
  const Result<RegistrationReports> result = registrar.register_pair(
      views[edge.source].surface->surface, views[edge.target].surface->surface, context);
  edge.answer = result ? answer_from_reports(result.value()) : answer_from_error(result.error());
  edge.answer.total_ms = static_cast<double>(clock.now_us() - begin_us) / 1000.0;
  edge.answer.peak_bytes = registrar.used_bytes();
}

}  // namespace

std::vector<ViewEdge> register_pairs(const std::vector<View>& views,
                                     const CommonFrameOptions& options) {
  const std::filesystem::path file = preset_file(options.preset);
  Preset preset = load_preset(file, models_folder(file), options.overrides);
  preset.models.clear();
  raise_limits(preset.limits, views);
  std::vector<ViewEdge> edges = pairs_within_reach(views.size(), options.reach);
  Progress progress("pairs", edges.size());
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      const std::unique_ptr<Registrar> registrar = Registrar::create(preset);
      for (std::size_t i = next++; i < edges.size(); i = next++) {
        register_one(*registrar, views, edges[i]);
        progress.step();
      }
    } catch (...) {
      const std::scoped_lock lock(mutex);
      failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 1; i < std::min(options.jobs, edges.size()); ++i) {
      threads.emplace_back(work);
    }
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return edges;
}

}  // namespace grapnel
