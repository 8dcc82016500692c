// The first steps: a Func, its Vars, its definition, and realizing it over a region.
#include "Halide.h"

#include <cstdio>

using namespace Halide;

int main() {
  // A Func maps points to values. A definition is data: it computes nothing.
  Func checker("checker");
  Var column("column"), row("row");
  Expr square = (column / 8 + row / 8) % 2;
  checker(column, row) = select(square == 0, 40, 200) + column;

  // realize() computes every point of a rectangle that starts at the origin.
  Buffer<int32_t> board = checker.realize({32, 16});
  printf("%d x %d x %d, %d dimensions\n", board.width(), board.height(), board.channels(),
         board.dimensions());
  for (int y = 0; y < board.height(); y += 5) {
    for (int x = 0; x < board.width(); x += 7) printf("%5d", board(x, y));
    printf("\n");
  }

  // The same Func can be realized at any size, and several other Funcs can read it.
  Func inverted;
  inverted(column, row) = 255 - checker(column, row);
  Buffer<int32_t> small = inverted.realize({4, 2});
  printf("inverted: %d %d %d %d\n", small(0, 0), small(1, 0), small(3, 0), small(3, 1));

  // A Func without dimensions is one value.
  Func answer;
  answer() = cast<double>(checker(9, 1)) / 4;
  Buffer<double> value = answer.realize();
  printf("answer: %g\n", value());

  // Properties of a Func.
  printf("%s: %d arguments, first \"%s\", defined: %d\n", checker.name().c_str(),
         checker.dimensions(), checker.args()[0].name().c_str(), (int)checker.defined());
  return 0;
}
