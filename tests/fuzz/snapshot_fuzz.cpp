// libFuzzer's entry.
#include "tests/fuzz/file_formats.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  grapnel::test::run_snapshot({data, size});
  return 0;
}
