#pragma once

#include <stdexcept>
#include <string>

namespace grapnel {

/// Input from outside (a file, an option) that can't be used. Its text is one line for a person:
/// what, where (file and line or frame), which value, what is allowed. Thrown only where files are
/// read, at start and on the housekeeping thread, and caught there.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace grapnel
