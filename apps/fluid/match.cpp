// match.cpp -- see match.h.
#include "match.h"

#include "solve.h"

namespace fluid {

using retrograde::Expr;
using retrograde::Func;
using retrograde::RDom;
using retrograde::Var;

Match::Match(const FrameShape& shape, retrograde::Type scalar, double reach)
    : density(scalar, 2, "density"), target(scalar, 2, "target") {
  const Var x("x"), y("y");
  const auto number = [&](double v) { return retrograde::cast(scalar, Expr(v)); };
  Func error("error");
  error(x, y) = density(x, y) - target(x, y);
  const double cells = reach * shape.cells_per_unit();
  const Func near = solve_directly({error,
                                    {shape.width, Ends::Free},
                                    {shape.height, Ends::Free},
                                    true,
                                    number(cells * cells),
                                    scalar,
                                    "near"});
  const RDom r(0, shape.width, 0, shape.height);
  const Expr e = error(r.x, r.y);
  const double share = 1.0 / static_cast<double>(shape.cells());
  loss() = number(0);
  loss() += number(0.5 * share) * e * (e + near(r.x, r.y));
  difference() = number(0);
  difference() += number(share) * e * e;
  gradient = retrograde::propagate_adjoints(loss, {.wrt = {density}})(density);
}

}  // namespace fluid
