#include "base/formats/text_writer.h"

#include <array>
#include <charconv>
#include <cmath>

namespace grapnel {
namespace {

template <class T>
void append_shortest(std::string& out, T value) {
  if (std::isnan(value)) {
    out += "nan";
    return;
  }
  std::array<char, 32> text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  out.append(text.data(), end);
}

}  // namespace

void append_number(std::string& out, float value) { append_shortest(out, value); }
void append_number(std::string& out, double value) { append_shortest(out, value); }

void append_text(std::vector<std::byte>& out, const std::string& text) {
  const auto* const first = reinterpret_cast<const std::byte*>(text.data());
  out.insert(out.end(), first, first + text.size());
}

}  // namespace grapnel
