#include "medians.h"

#include <array>

namespace demosaic {

using lang::Expr;
using lang::Func;

namespace {

using Three = std::array<Expr, 3>;

Three sorted(const Expr& a, const Expr& b, const Expr& c) {
  const Expr low = lang::min(a, b), high = lang::max(a, b);
  return {lang::min(low, c), lang::max(low, lang::min(high, c)), lang::max(high, c)};
}

}  // namespace

Func median_3x3(const Func& f, const lang::Var& x, const lang::Var& y,
                const std::vector<lang::Var>& rest, const std::string& name) {
  const auto place = [&](int dx, int dy) {
    std::vector<Expr> at{x + dx, y + dy};
    at.insert(at.end(), rest.begin(), rest.end());
    return at;
  };
  Func column(name + "_column"), median(name);
  const Three column_here = sorted(f(place(0, -1)), f(place(0, 0)), f(place(0, 1)));
  column(place(0, 0)) = lang::Tuple(column_here[0], column_here[1], column_here[2]);
  const auto of_rank = [&](int rank) {
    return sorted(column(place(-1, 0))[rank], column(place(0, 0))[rank], column(place(1, 0))[rank]);
  };
  median(place(0, 0)) = sorted(of_rank(0)[2], of_rank(1)[1], of_rank(2)[0])[1];
  return median;
}

}  // namespace demosaic
