#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

#include "base/input_error.h"
#include "tools/codegen/generate.h"

namespace {

constexpr const char* kUsage =
    "usage: grapnel-codegen --write ROOT | --check ROOT\n"
    "Writes, or compares, the files made from base/codes.toml and\n"
    "drivers/modbus/register_map.toml below ROOT.\n";

std::string read_whole(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

int check(const std::filesystem::path& root) {
  int different = 0;
  for (const auto& file : grapnel::codegen::generate_all(root)) {
    if (read_whole(root / file.path) == file.text) continue;
    std::cerr << file.path << ": differs from its table; run grapnel-codegen --write\n";
    ++different;
  }
  return different == 0 ? 0 : 1;
}

int write(const std::filesystem::path& root) {
  for (const auto& file : grapnel::codegen::generate_all(root)) {
    if (read_whole(root / file.path) == file.text) continue;
    std::filesystem::create_directories((root / file.path).parent_path());
    std::ofstream stream(root / file.path, std::ios::binary | std::ios::trunc);
    stream << file.text;
    if (!stream.flush()) throw grapnel::InputError(file.path + ": can't be written");
    std::cout << file.path << "\n";
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string option = argc == 3 ? argv[1] : "";
  try {
    if (option == "--check") return check(argv[2]);
    if (option == "--write") return write(argv[2]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 2;
  }
  const bool help = argc == 2 && std::string(argv[1]) == "--help";
  (help ? std::cout : std::cerr) << kUsage;
  return help ? 0 : 2;
}
