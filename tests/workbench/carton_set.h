#pragma once

#include <gtest/gtest.h>

#include "tests/support/temp_folder.h"
#include "tests/workbench/text_file.h"

namespace grapnel::test {

/// A folder with set/: three cartons of two sizes and two empty belts or wrong parts, made once.
inline const TempFolder& carton_set() {
  static const TempFolder folder;
  static const int code =
      run_command({"simulate", "--set-of", "carton", "--split", "tune", "--positives", "3",
                   "--either", "0", "--negatives", "2", "--instances", "2", "-o", folder / "set"})
          .code;
  EXPECT_EQ(code, 0);
  return folder;
}

}  // namespace grapnel::test
