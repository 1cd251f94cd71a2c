#include "tools/codegen/generate.h"

#include <cmath>

namespace grapnel::codegen {

std::string constant_name(const std::string& register_name) {
  std::string name = "k";
  bool upper = true;
  for (const char c : register_name) {
    if (c == '_') {
      upper = true;
      continue;
    }
    const bool letter = c >= 'A' && c <= 'Z';
    name += letter && !upper ? static_cast<char>(c - 'A' + 'a') : c;
    upper = false;
  }
  return name;
}

std::string scale_text(double scale) {
  if (scale == 0.0) return "0";
  std::string text = "1";
  int digits = 0;
  for (double s = scale; s < 0.5; s *= 10.0) ++digits;
  if (digits > 0) text = "0." + std::string(static_cast<std::size_t>(digits - 1), '0') + "1";
  return text;
}

std::vector<GeneratedFile> generate_all(const std::filesystem::path& root) {
  const std::vector<CodeRow> codes = load_codes(root / "base/codes.toml");
  const RegisterMap map = load_register_map(root / "drivers/modbus/register_map.toml");
  return {
      {"base/code.h", generate_code_header(codes)},
      {"base/code_table.cpp", generate_code_table(codes)},
      {"docs/status-codes.md", generate_code_manual(codes)},
      {"drivers/modbus/registers.h", generate_register_header(map)},
      {"docs/registers.md", generate_register_manual(map, codes)},
      {"docs/clients/GRAPNEL.st", generate_structured_text(map)},
      {"docs/clients/grapnel_client.py", generate_python_client(map)},
  };
}

}  // namespace grapnel::codegen
