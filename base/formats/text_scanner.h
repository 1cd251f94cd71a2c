#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/input_error.h"

namespace grapnel {

/// Walks through a text line by line and names file and line in what it complains about.
class TextScanner {
 public:
  TextScanner(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  /// The next line without its end (LF or CR LF). False at the end of the text.
  bool next_line(std::string_view& line) noexcept;
  /// The next word across lines. False at the end of the text.
  bool next_word(std::string_view& word) noexcept;
  /// Number of the line that was read last, or in which the last word stands, from 1.
  [[nodiscard]] std::size_t line() const noexcept { return line_ + (inside_line_ ? 1 : 0); }
  /// Bytes read so far.
  [[nodiscard]] std::size_t offset() const noexcept { return at_; }
  [[nodiscard]] std::size_t remaining() const noexcept { return text_.size() - at_; }
  /// "FILE:LINE: TEXT".
  [[nodiscard]] InputError problem(const std::string& text) const;

 private:
  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;  // whole lines read
  bool inside_line_ = false;
};

/// Splits the first word (blanks and tabs part words) off `rest`. False when there is none.
bool take_word(std::string_view& rest, std::string_view& word) noexcept;

/// A decimal number, "nan" and "inf" included; too small is 0, too large infinite. False when
/// `word` is anything else.
[[nodiscard]] bool parse_number(std::string_view word, double& value) noexcept;
/// A whole number from 0; false also when it does not fit.
[[nodiscard]] bool parse_count(std::string_view word, std::uint64_t& value) noexcept;

/// `word` between quotes, cut to a printable 40 characters, for messages.
[[nodiscard]] std::string quote_word(std::string_view word);

}  // namespace grapnel
