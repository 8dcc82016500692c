// Loops over time: the outermost reduction variable is the step, which computes a state from the
// last one. Checkpoints are for these.
#include "gradient/adversary/maker.h"

namespace retrograde::gradient {

// A state with the dimensions of f, or one that a second reduction variable runs through.
void Maker::add_loop() {
  budget_ = 8;
  Func f("loop" + std::to_string(p_.funcs.size()));
  const std::vector<Var> vars = first_variables(c_.between(1, 2));
  Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
  std::vector<Expr> values;
  for (int n = c_.chance(30) ? 2 : 1; n > 0; --n) values.push_back(value(Float(32), at, 1));
  f(vars) = Tuple(values);
  const Range time{Expr(c_.chance(30) ? c_.around_zero(3) : 0), Expr(c_.between(2, 12))};
  const bool runs_through = c_.chance(40);
  RDom r(runs_through ? Region{{Expr(c_.below(2)), Expr(c_.between(2, natural_size))}, time}
                      : Region{time});
  if (c_.chance(15)) r.where(places_.condition({r[r.dimensions() - 1]}));
  at.self = f;
  at.write.assign(vars.begin(), vars.end());
  at.is_pure.assign(vars.size(), true);
  if (runs_through) {
    at.write[0] = at.all[0] = r.x;
    at.is_pure[0] = false;
  }
  at.all.push_back(r[r.dimensions() - 1]);
  std::vector<Expr> next;
  for (int k = 0; k < f.outputs(); ++k) next.push_back(stepped(f, k, at));
  f(at.write) = Tuple(next);
  p_.funcs.push_back(f);
}

// Of bounded size after any number of steps.
Expr Maker::stepped(const Func& f, int k, const Point& at) {
  const Expr self = f(at.write).element(k), other = f(at.write).element(f.outputs() - 1 - k);
  const Expr input = value(Float(32), at, 1);
  switch (c_.below(7)) {
    case 0:
      return self * 0.75f + input;
    case 1:
      return sin(self + input);
    case 2:
      return self * (1.5f - self * self * 0.5f) + input * 0.125f;
    case 3:
      return tanh(other * input + self);
    case 4:
      return (self + converted(Float(32), read_self(at))) * 0.5f + input * 0.25f;
    case 5:
      return max(self * 0.5f, input);
    default:
      return select(places_.condition(at.all), self, cos(self) * input);
  }
}

}  // namespace retrograde::gradient
