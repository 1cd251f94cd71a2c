#pragma once

#include <string>

#include "base/code.h"
#include "base/input_error.h"

namespace grapnel {

/// Why a configuration was refused: a line for people and the 50xx code for the PLC.
class ConfigProblem : public InputError {
 public:
  ConfigProblem(Code code, const std::string& text) : InputError(text), code_(code) {}
  [[nodiscard]] Code code() const noexcept { return code_; }

 private:
  Code code_;
};

}  // namespace grapnel
