// medians.h -- the median of 3 x 3 pixels.
//
// Each column is sorted once for the three windows that contain it. The median of all nine is the median of the largest
// low, the middle of the middles, and the smallest high (J. Smith, Implementing median filters in XC4000E FPGAs, Xcell
// 23, 1996).
#pragma once

#include <retrograde/retrograde.h>

#include <string>
#include <vector>

namespace demosaic {

namespace lang = retrograde;

// The median of f(x, y, ...) over x and y; `rest` are its other variables.
lang::Func median_3x3(const lang::Func& f, const lang::Var& x, const lang::Var& y,
                      const std::vector<lang::Var>& rest, const std::string& name);

}  // namespace demosaic
