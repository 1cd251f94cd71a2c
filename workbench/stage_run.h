#pragma once

#include <memory>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/arena.h"
#include "base/config.h"
#include "pipeline/registry.h"
#include "pipeline/stage.h"

namespace grapnel {

/// A block of fixed memory, 64-byte aligned.
class Block {
 public:
  explicit Block(std::size_t bytes)
      : bytes_(bytes + Arena::kAlignment),
        data_(new (std::align_val_t{Arena::kAlignment}) std::byte[bytes_]) {}

  [[nodiscard]] std::span<std::byte> span() noexcept { return {data_.get(), bytes_}; }

 private:
  struct Free {
    void operator()(std::byte* data) const noexcept {
      ::operator delete[](data, std::align_val_t{Arena::kAlignment});
    }
  };
  std::size_t bytes_;
  std::unique_ptr<std::byte[], Free> data_;
};

/// Measures what `reserve(arena)` takes, then carves it out of a block of that size.
template <class Reserve>
[[nodiscard]] Block carve(Reserve reserve) {
  Arena measure;
  reserve(measure);
  Block block(measure.used_bytes());
  Arena arena(block.span());
  reserve(arena);
  return block;
}

/// One stage outside of a pipeline, with its memory: `--set key=value` over the method's defaults.
template <class StageKind>
class LoadedStage {
 public:
  /// Throws InputError: unknown method, key or value.
  LoadedStage(std::span<const Method<StageKind>> methods, const std::string& method,
              const std::vector<std::string>& overrides, const Limits& limits)
      : stage_(make(methods, method, overrides)),
        block_(carve([&](Arena& arena) { stage_->reserve(arena, limits); })) {}

  [[nodiscard]] StageKind& operator*() noexcept { return *stage_; }
  [[nodiscard]] StageKind* operator->() noexcept { return stage_.get(); }

 private:
  static std::unique_ptr<StageKind> make(std::span<const Method<StageKind>> methods,
                                         const std::string& method,
                                         const std::vector<std::string>& overrides) {
    ConfigTable table("command line", "", 0);
    for (const std::string& assignment : overrides) apply_override(table, assignment);
    ConfigReader reader(table);
    std::unique_ptr<StageKind> stage = find_method(methods, method).make(reader);
    reader.finish();
    return stage;
  }

  std::unique_ptr<StageKind> stage_;
  Block block_;
};

/// Names of a table of methods, for --help.
template <class StageKind>
[[nodiscard]] std::string method_names(std::span<const Method<StageKind>> methods) {
  std::string names;
  for (const Method<StageKind>& method : methods) {
    names += (names.empty() ? "" : ", ") + std::string(method.name);
  }
  return names;
}

/// Throws InputError that says what the stage answered.
void require_ok(const Status& status, const std::string& what);

/// Limits under which a stage takes `points` points and never cuts a list of keypoints.
[[nodiscard]] Limits limits_for(std::size_t points);

/// Whether the fields hold the engine that a mode names; false for fast where there is but one.
[[nodiscard]] bool add_engine(FieldTable fields, const std::string& mode);
/// The overrides with `--mode` as the method's engine. Throws InputError: a mode other than fast
/// and reference, or a reference engine asked of a method that has but one.
template <class StageKind>
[[nodiscard]] std::vector<std::string> with_mode(std::span<const Method<StageKind>> methods,
                                                 const std::string& method,
                                                 std::vector<std::string> overrides,
                                                 const std::string& mode) {
  if (add_engine(find_method(methods, method).fields(), mode)) {
    overrides.push_back("engine=" + mode);
  }
  return overrides;
}

/// Fills the surface's normals where it has none: least-squares planes with default radius.
void ensure_normals(Surface& surface);

}  // namespace grapnel
