#include "workbench/options.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <iostream>
#include <system_error>

#include "base/config.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end == std::string::npos ? end : end - begin));
    if (end == std::string::npos) return parts;
    begin = end + 1;
  }
}

std::size_t parse_index(const std::string& text, const std::string& what) {
  std::size_t index = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, index);
  if (error != std::errc() || stop != end) {
    throw InputError(what + ": \"" + text + "\" is not an index; 0,2,4 or 0-8:2 are allowed");
  }
  return index;
}

}  // namespace

struct Options::State {
  CLI::App app;
  std::string command;

  State(const std::string& name, const std::string& summary)
      : app(summary, "grapnel " + name), command(name) {
    app.set_help_flag("-h,--help", "print this text");
    app.allow_windows_style_options(false);
    app.get_formatter()->column_width(34);
    app.get_formatter()->label("REQUIRED", "(required)");
  }

  [[nodiscard]] InputError usage(const std::string& text) const {
    return InputError(text + " (see grapnel " + command + " --help)");
  }

  [[nodiscard]] std::string unknown_text() const {
    const std::vector<std::string> extras = app.remaining();
    std::vector<std::string> known;
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
      for (const std::string& name : option->get_snames()) known.push_back("-" + name);
    }
    for (const std::string& extra : extras) {
      if (extra.empty() || extra[0] != '-') continue;
      const std::string name = extra.substr(0, extra.find('='));
      const std::string nearest = nearest_name(name, known);
      return "unknown option " + name +
             (nearest.empty() ? std::string() : "; did you mean " + nearest + "?");
    }
    return extras.empty() ? "too many arguments" : "unexpected argument \"" + extras.front() + "\"";
  }
};

Options::Options(const std::string& command, const std::string& summary)
    : state_(std::make_unique<State>(command, summary)) {}

Options::~Options() = default;

void Options::positional(const std::string& name, std::string& value, const std::string& help) {
  state_->app.add_option(name, value, help)->required()->type_name("");
}

void Options::positionals(const std::string& name, std::vector<std::string>& values,
                          std::size_t minimum, const std::string& help) {
  CLI::Option* option = state_->app.add_option(name, values, help)->type_name("");
  if (minimum > 0) option->required()->expected(static_cast<int>(minimum), 1 << 20);
}

void Options::value(const std::string& names, std::string& value, const std::string& help) {
  state_->app.add_option(names, value, help)->type_name("TEXT");
}

void Options::value(const std::string& names, std::optional<std::string>& value,
                    const std::string& help) {
  state_->app.add_option(names, value, help)->type_name("TEXT");
}

void Options::required(const std::string& names, std::string& value, const std::string& help) {
  state_->app.add_option(names, value, help)->required()->type_name("TEXT");
}

void Options::number(const std::string& names, double& value, double minimum, double maximum,
                     const std::string& help) {
  state_->app.add_option(names, value, help)
      ->type_name("NUMBER")
      ->check(CLI::Range(minimum, maximum));
}

void Options::integer(const std::string& names, std::int64_t& value, std::int64_t minimum,
                      std::int64_t maximum, const std::string& help) {
  state_->app.add_option(names, value, help)->type_name("N")->check(CLI::Range(minimum, maximum));
}

void Options::repeated(const std::string& names, std::vector<std::string>& values,
                       const std::string& help) {
  state_->app.add_option(names, values, help)
      ->type_name("TEXT")
      ->expected(1)
      ->take_all()
      ->allow_extra_args(false);
}

void Options::list(const std::string& names, std::vector<std::string>& values,
                   const std::string& help) {
  state_->app.add_option(names, values, help)
      ->type_name("TEXT…")
      ->delimiter(',')
      ->expected(1, 1 << 20);
}

void Options::flag(const std::string& names, bool& value, const std::string& help) {
  state_->app.add_flag(names, value, help);
}

void Options::footer(const std::string& text) { state_->app.footer(text); }

bool Options::parse(std::span<const std::string> arguments) {
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    state_->app.parse(reversed);
  } catch (const CLI::CallForHelp&) {
    std::cout << state_->app.help();
    return false;
  } catch (const CLI::ExtrasError&) {
    throw state_->usage(state_->unknown_text());
  } catch (const CLI::RequiredError& error) {
    // An unknown option explains a missing argument better than its absence does.
    const std::string unknown = state_->unknown_text();
    throw state_->usage(unknown.starts_with("unknown option") ? unknown : error.what());
  } catch (const CLI::ParseError& error) {
    throw state_->usage(error.what());
  }
  return true;
}

std::vector<std::size_t> parse_indices(const std::string& text, const std::string& what) {
  constexpr std::size_t kMaxIndices = 1u << 20;
  std::vector<std::size_t> indices;
  for (const std::string& part : split(text, ',')) {
    const std::size_t dash = part.find('-');
    if (dash == std::string::npos) {
      indices.push_back(parse_index(part, what));
      continue;
    }
    const std::size_t colon = part.find(':', dash);
    const std::size_t first = parse_index(part.substr(0, dash), what);
    const std::size_t last = parse_index(part.substr(dash + 1, colon - dash - 1), what);
    const std::size_t step =
        colon == std::string::npos ? 1 : parse_index(part.substr(colon + 1), what);
    if (step == 0 || last < first || (last - first) / step > kMaxIndices) {
      throw InputError(what + ": \"" + part + "\" is not a range; FIRST-LAST:STEP is allowed");
    }
    for (std::size_t i = first; i <= last; i += step) indices.push_back(i);
  }
  return indices;
}

std::vector<double> parse_numbers(const std::string& text, std::size_t count,
                                  const std::string& what) {
  std::vector<double> numbers;
  for (const std::string& part : split(text, ',')) {
    double number = 0.0;
    const char* end = part.data() + part.size();
    const auto [stop, error] = std::from_chars(part.data(), end, number);
    if (error != std::errc() || stop != end || !std::isfinite(number)) {
      throw InputError(what + ": \"" + part + "\" is not a finite number");
    }
    numbers.push_back(number);
  }
  if (count != 0 && numbers.size() != count) {
    throw InputError(what + ": " + std::to_string(numbers.size()) + " numbers given, " +
                     std::to_string(count) + " are needed");
  }
  return numbers;
}

}  // namespace grapnel
