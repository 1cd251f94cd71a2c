#include "base/formats/text_scanner.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

namespace grapnel {
namespace {

constexpr std::size_t kMaxQuoted = 40;

bool blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

}  // namespace

bool TextScanner::next_line(std::string_view& line) noexcept {
  if (at_ >= text_.size()) return false;
  const std::size_t end = text_.find('\n', at_);
  const bool last = end == std::string_view::npos;
  line = text_.substr(at_, last ? std::string_view::npos : end - at_);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  at_ = last ? text_.size() : end + 1;
  inside_line_ = false;
  ++line_;
  return true;
}

bool TextScanner::next_word(std::string_view& word) noexcept {
  while (at_ < text_.size() && (blank(text_[at_]) || text_[at_] == '\n')) {
    if (text_[at_] == '\n') ++line_;
    ++at_;
  }
  const std::size_t begin = at_;
  while (at_ < text_.size() && !blank(text_[at_]) && text_[at_] != '\n') ++at_;
  inside_line_ = at_ > 0 && text_[at_ - 1] != '\n';
  word = text_.substr(begin, at_ - begin);
  return !word.empty();
}

InputError TextScanner::problem(const std::string& text) const {
  return InputError(file_ + ":" + std::to_string(line()) + ": " + text);
}

bool take_word(std::string_view& rest, std::string_view& word) noexcept {
  std::size_t begin = 0;
  while (begin < rest.size() && blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !blank(rest[end])) ++end;
  word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return !word.empty();
}

bool parse_number(std::string_view word, double& value) noexcept {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (stop != end || word.empty()) return false;
  if (error == std::errc::result_out_of_range) {
    const std::string_view digits = word.front() == '-' ? word.substr(1) : word;
    const std::size_t exponent = digits.find_first_of("eE");
    const bool small =
        exponent == std::string_view::npos ? digits.front() == '0' : digits[exponent + 1] == '-';
    value = small ? 0.0 : std::numeric_limits<double>::infinity();
    if (word.front() == '-') value = -value;
    return true;
  }
  return error == std::errc{};
}

bool parse_count(std::string_view word, std::uint64_t& value) noexcept {
  const char* const end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  return !word.empty() && stop == end && error == std::errc{};
}

std::string quote_word(std::string_view word) {
  std::string text = "\"";
  for (const char c : word.substr(0, kMaxQuoted)) text += c >= ' ' && c <= '~' ? c : '?';
  if (word.size() > kMaxQuoted) text += "...";
  return text + "\"";
}

}  // namespace grapnel
