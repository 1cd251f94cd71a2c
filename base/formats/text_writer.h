#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace grapnel {

/// Appends the shortest text that reads back as the same number; "nan" for NaN.
void append_number(std::string& out, float value);
void append_number(std::string& out, double value);

/// The bytes of `text` at the end of `out`.
void append_text(std::vector<std::byte>& out, const std::string& text);

}  // namespace grapnel
