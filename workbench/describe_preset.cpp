#include <iostream>

#include "pipeline/preset.h"
#include "workbench/commands.h"
#include "workbench/options.h"

namespace grapnel {

int run_describe_preset(std::span<const std::string> args) {
  Options options("describe-preset",
                  "Prints every key of a preset with unit, range, default and help, as TOML.");
  if (!options.parse(args)) return 0;
  std::cout << describe_preset();
  return 0;
}

}  // namespace grapnel
