// Expects that ptxas, if it is installed, accepts PTX.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "support/ptxas.h"

namespace retrograde {

// Prints a note about the skipped check if there is no ptxas.
inline void expect_ptxas_takes(const std::string& ptx, const std::string& chip) {
  static int skipped = 0;
  if (!has_ptxas()) {
    std::printf("skipped, for no ptxas is installed: %d modules of PTX by now, %zu bytes for %s\n",
                ++skipped, ptx.size(), chip.c_str());
    return;
  }
  EXPECT_EQ(ptxas_problem(ptx, chip, "-O0"), "");
}

}  // namespace retrograde
