#include "bilinear.h"

#include "bayer.h"

namespace demosaic {

using lang::Expr;

lang::Func bilinear(const lang::Func& mosaic) {
  lang::Var x("x"), y("y"), c("c");
  const auto m = [&](int dx, int dy) { return Expr(mosaic(x + dx, y + dy)); };
  const Expr here = m(0, 0), row = (m(-1, 0) + m(1, 0)) / 2, column = (m(0, -1) + m(0, 1)) / 2;
  const Expr cross = (row + column) / 2;
  const Expr corners = (m(-1, -1) + m(1, -1) + m(-1, 1) + m(1, 1)) / 4;
  lang::Func image("bilinear");
  image(x, y, c) = lang::select(c == 0, by_place(x, y, here, row, column, corners),
                                lang::select(c == 1, by_place(x, y, cross, here, here, cross),
                                             by_place(x, y, corners, column, row, here)));
  return image;
}

}  // namespace demosaic
