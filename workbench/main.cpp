#include <string>
#include <vector>

#include "workbench/commands.h"

int main(int argc, char** argv) {
  const std::vector<std::string> args(argv + 1, argv + argc);
  return grapnel::run_grapnel(args);
}
