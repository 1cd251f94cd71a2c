#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/codegen/tables.h"

namespace grapnel::codegen {

/// One generated file.
struct GeneratedFile {
  std::string path;  ///< from the root of the source tree
  std::string text;
};

[[nodiscard]] std::string generate_code_header(const std::vector<CodeRow>& codes);
[[nodiscard]] std::string generate_code_table(const std::vector<CodeRow>& codes);
[[nodiscard]] std::string generate_code_manual(const std::vector<CodeRow>& codes);
[[nodiscard]] std::string generate_register_header(const RegisterMap& map);
[[nodiscard]] std::string generate_register_manual(const RegisterMap& map,
                                                   const std::vector<CodeRow>& codes);
[[nodiscard]] std::string generate_structured_text(const RegisterMap& map);
[[nodiscard]] std::string generate_python_client(const RegisterMap& map);

/// Every generated file, from the tables below `root`. Throws InputError when a table can't be
/// used.
[[nodiscard]] std::vector<GeneratedFile> generate_all(const std::filesystem::path& root);

/// A C++ constant's name: CMD_SEQ gives kCmdSeq.
[[nodiscard]] std::string constant_name(const std::string& register_name);

/// A number without trailing zeros: 0.001, 1.
[[nodiscard]] std::string scale_text(double scale);

}  // namespace grapnel::codegen
