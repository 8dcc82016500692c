// bayer.h -- the colours of the samples in the mosaic R G over G B.
#pragma once

#include <retrograde/retrograde.h>

namespace demosaic {

namespace lang = retrograde;

// Selects one of four expressions by the position of (x, y) in its cell of two by two samples.
inline lang::Expr by_place(const lang::Expr& x, const lang::Expr& y, const lang::Expr& at_red,
                           const lang::Expr& beside_red, const lang::Expr& beside_blue,
                           const lang::Expr& at_blue) {
  return lang::select(y % 2 == 0, lang::select(x % 2 == 0, at_red, beside_red),
                      lang::select(x % 2 == 0, beside_blue, at_blue));
}

}  // namespace demosaic
