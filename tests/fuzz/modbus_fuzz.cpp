// libFuzzer's entry.
#include "tests/fuzz/modbus_stream.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  grapnel::test::run_modbus_stream({data, size});
  grapnel::test::run_rtu_stream({data, size});
  return 0;
}
