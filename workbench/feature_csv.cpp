#include "workbench/feature_csv.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "base/input_error.h"

namespace grapnel {
namespace {

/// The finite numbers of a line between commas. Throws InputError.
std::vector<double> numbers_of(std::string_view line, const std::string& place) {
  std::vector<double> numbers;
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  for (;;) {
    const std::size_t comma = line.find(',');
    std::string_view word = line.substr(0, comma);
    while (!word.empty() && word.front() == ' ') word.remove_prefix(1);
    double number = 0.0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || stop != word.data() + word.size() || !std::isfinite(number)) {
      throw InputError(place + ": \"" + std::string(word.substr(0, 40)) +
                       "\" is not a finite number");
    }
    numbers.push_back(number);
    if (comma == std::string_view::npos) return numbers;
    line.remove_prefix(comma + 1);
  }
}

/// Calls `take(numbers, place)` for every line that is not empty.
template <class Take>
void for_each_line(const std::filesystem::path& file, Take take) {
  std::ifstream stream(file);
  if (!stream) throw InputError(file.string() + ": can't be opened for reading");
  std::size_t line_number = 0;
  for (std::string line; std::getline(stream, line);) {
    const std::string place = file.string() + ":" + std::to_string(++line_number);
    if (line.empty() || line == "\r") continue;
    take(numbers_of(line, place), place);
  }
}

std::int32_t index_of(double value, const std::string& place) {
  if (value < 0.0 || value > std::numeric_limits<std::int32_t>::max() ||
      std::floor(value) != value) {
    throw InputError(place + ": an index is a whole number from 0");
  }
  return static_cast<std::int32_t>(value);
}

std::vector<Correspondence> parse_json(const std::filesystem::path& file, std::ifstream& stream) {
  std::vector<Correspondence> pairs;
  try {
    const nlohmann::json json = nlohmann::json::parse(stream);
    for (const nlohmann::json& pair : json.at("correspondences")) {
      const std::string place = file.string() + ": pair " + std::to_string(pairs.size());
      pairs.push_back({index_of(pair.at("source").get<double>(), place),
                       index_of(pair.at("target").get<double>(), place),
                       pair.value("distance", 0.0F)});
    }
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file.string() + ": " + error.what());
  }
  return pairs;
}

}  // namespace

FeatureTable load_feature_csv(const std::filesystem::path& file) {
  FeatureTable table;
  for_each_line(file, [&](const std::vector<double>& numbers, const std::string& place) {
    if (table.rows() == 0) table.dimension = numbers.size() - 1;
    if (numbers.size() < 2 || numbers.size() - 1 != table.dimension) {
      throw InputError(place + ": " + std::to_string(numbers.size()) +
                       " numbers; an index and the same number of bins in every row are needed");
    }
    table.index.push_back(index_of(numbers[0], place));
    for (std::size_t i = 1; i < numbers.size(); ++i) {
      table.bins.push_back(static_cast<float>(numbers[i]));
    }
  });
  if (table.rows() == 0) throw InputError(file.string() + ": has no row");
  return table;
}

std::vector<Correspondence> load_correspondences(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw InputError(file.string() + ": can't be opened for reading");
  if ((stream >> std::ws).peek() == '{') return parse_json(file, stream);
  std::vector<Correspondence> pairs;
  for_each_line(file, [&](const std::vector<double>& numbers, const std::string& place) {
    if (numbers.size() < 2 || numbers.size() > 3) {
      throw InputError(place + ": source,target,distance is needed");
    }
    pairs.push_back({index_of(numbers[0], place), index_of(numbers[1], place),
                     numbers.size() == 3 ? static_cast<float>(numbers[2]) : 0.0F});
  });
  return pairs;
}

void print_correspondences(const std::vector<Correspondence>& pairs, bool json) {
  if (!json) {
    for (const Correspondence& pair : pairs) {
      std::cout << pair.source << "," << pair.target << "," << pair.distance << "\n";
    }
    return;
  }
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Correspondence& pair : pairs) {
    list.push_back({{"source", pair.source}, {"target", pair.target}, {"distance", pair.distance}});
  }
  std::cout << nlohmann::ordered_json{{"correspondences", list}}.dump(2) << "\n";
}

}  // namespace grapnel
