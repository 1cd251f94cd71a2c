#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace grapnel {

/// The arguments of one subcommand: declared first, then parsed. What the variables hold before
/// parse() is the default. Unknown options are refused with the nearest known one.
class Options {
 public:
  /// `summary` is one sentence for --help.
  Options(const std::string& command, const std::string& summary);
  ~Options();
  Options(const Options&) = delete;
  Options& operator=(const Options&) = delete;

  /// A required argument by position, in the order of declaration.
  void positional(const std::string& name, std::string& value, const std::string& help);
  /// All remaining arguments by position; at least `minimum`.
  void positionals(const std::string& name, std::vector<std::string>& values, std::size_t minimum,
                   const std::string& help);
  /// `names` as "-o,--output"; a value follows.
  void value(const std::string& names, std::string& value, const std::string& help);
  void value(const std::string& names, std::optional<std::string>& value, const std::string& help);
  /// Must be given.
  void required(const std::string& names, std::string& value, const std::string& help);
  void number(const std::string& names, double& value, double minimum, double maximum,
              const std::string& help);
  void integer(const std::string& names, std::int64_t& value, std::int64_t minimum,
               std::int64_t maximum, const std::string& help);
  /// One value an occurrence; may be repeated.
  void repeated(const std::string& names, std::vector<std::string>& values,
                const std::string& help);
  /// One or more values after one option, also comma separated.
  void list(const std::string& names, std::vector<std::string>& values, const std::string& help);
  void flag(const std::string& names, bool& value, const std::string& help);
  /// Text under the options in --help.
  void footer(const std::string& text);

  /// False when --help was asked for and printed. Throws InputError (one line) on wrong usage.
  [[nodiscard]] bool parse(std::span<const std::string> arguments);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// "0,2,4" or "0-8:2" or a mix as indices, in the order given. Throws InputError naming `what`.
[[nodiscard]] std::vector<std::size_t> parse_indices(const std::string& text,
                                                     const std::string& what);

/// Comma-separated numbers; `count` of them unless it is 0. Throws InputError naming `what`.
[[nodiscard]] std::vector<double> parse_numbers(const std::string& text, std::size_t count,
                                                const std::string& what);

}  // namespace grapnel
