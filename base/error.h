#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>
#include <variant>

#include "base/assert.h"
#include "base/code.h"

namespace grapnel {

/// Part of the program an error or a stage time belongs to. Order is the pipeline's order; the
/// number is what STATUS_DETAIL and the diagnostics registers carry.
enum class Stage : std::uint16_t {
  None = 0,
  Capture,
  Organize,
  Median,
  Outliers,
  Background,
  Segment,
  Decimate,
  Normals,
  Keypoints,
  Descriptors,
  Match,
  Reject,
  Coarse,
  Refine,
  Judge,
  Publish,
  Config,
  Model,
  FieldBus,
  Recording,
  kCount
};

/// Lower-case name of a stage, as in reports ("keypoints").
[[nodiscard]] const char* stage_name(Stage stage) noexcept;

/// Why something did not work: 8 bytes, no text. `detail` depends on the code (errno, a count, an
/// index); text for people is made from the table of codes where it is shown.
struct Error {
  Code code = Code::InternalFault;
  Stage stage = Stage::None;
  std::int32_t detail = 0;

  friend bool operator==(const Error&, const Error&) = default;
};
static_assert(sizeof(Error) == 8);

/// A value or an Error. Never both, never neither.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, error) {}

  [[nodiscard]] bool ok() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return ok(); }

  /// Precondition: ok().
  [[nodiscard]] T& value() noexcept {
    GRAPNEL_ASSERT(ok());
    return *std::get_if<0>(&state_);
  }
  [[nodiscard]] const T& value() const noexcept {
    GRAPNEL_ASSERT(ok());
    return *std::get_if<0>(&state_);
  }
  /// Precondition: !ok().
  [[nodiscard]] const Error& error() const noexcept {
    GRAPNEL_ASSERT(!ok());
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<T, Error> state_;
};

/// Success or an Error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(error), ok_(false) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  explicit operator bool() const noexcept { return ok_; }
  /// Precondition: !ok().
  [[nodiscard]] const Error& error() const noexcept {
    GRAPNEL_ASSERT(!ok_);
    return error_;
  }

 private:
  Error error_{};
  bool ok_ = true;
};

using Status = Result<void>;

}  // namespace grapnel
