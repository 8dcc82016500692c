// Measures the error of a problem's adjoint, in float32 and as machine code, against its true gradient.
#pragma once

#include <array>
#include <string>

#include "stability/extremes.h"
#include "stability/problems.h"

namespace retrograde::stability {

// A cell of the result table: the cases whose true gradient is finite in float32.
struct Cell {
  int cases = 0;
  int lost = 0;  // came out infinite or NaN
  double worst_error =
      0;  // the worst error of the other cases, relative to their largest derivative
  std::string lost_at, worst_at;
};
struct Row {
  std::array<Cell, extreme_count> cells;  // indexed by the most extreme number of a case
  Cell left;  // the program's values or adjoints leave float32 (traced.h), whatever the numbers
};

Row measure(const Problem& problem);

}  // namespace retrograde::stability
