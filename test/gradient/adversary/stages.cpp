// Funcs, their updates and reductions.
#include "frontend/language/inline_reductions.h"
#include "gradient/adversary/maker.h"

namespace retrograde::gradient {

std::vector<Var> first_variables(int dimensions) {
  const std::vector<Var> all{Var("x"), Var("y"), Var("z")};
  return {all.begin(), all.begin() + dimensions};
}

Type Maker::value_type() {
  switch (c_.below(20)) {
    case 15:
    case 16:
      return Float(64);
    case 17:
      return Float(16);
    case 18:
      return Int(32);
    case 19:
      return c_.chance(50) ? UInt(8) : BFloat(16);
    default:
      return Float(32);
  }
}

Region Maker::ranges(int most) {
  Region result;
  for (int n = c_.between(1, most); n > 0; --n) {
    const int low = c_.chance(30) ? c_.around_zero(3) : 0;
    Expr extent = c_.chance(12)                             ? Expr(p_.count)
                  : c_.chance(12)                           ? Expr(c_.below(2))
                  : c_.chance(6) && p_.handles[0].defined() ? p_.handles[0].dim(0).extent()
                                                            : Expr(c_.between(2, natural_size));
    result.push_back({Expr(low), extent});
  }
  return result;
}

RDom Maker::domain(int most) {
  RDom r(ranges(most));
  if (!c_.chance(30)) return r;
  std::vector<Expr> all;
  for (int d = 0; d < r.dimensions(); ++d) all.push_back(r[d]);
  Point at{all, {}, Func(), {}};
  r.where(c_.chance(25) ? leaf(Float(32), at) > 0.75f : places_.condition(all));
  return r;
}

Expr Maker::reduced(const Type& type, const Point& at, int depth) {
  RDom r(ranges(1));
  Point inner{
      at.all, {}, Func(), {}};  // an inline reduction becomes a Func: it reads no unfinished one
  inner.all.push_back(r.x);
  const Expr a = value(type, inner, std::min(depth - 1, 1));
  switch (c_.below(6)) {
    case 0:
      return sum(r, a);
    case 1:
      return product(r, a);
    case 2:  // of nothing: infinite
      return max(maximum(r, a), converted(type, Expr(-9.0f)));
    case 3:
      return min(minimum(r, a), converted(type, Expr(9.0f)));
    case 4:
      return select(argmax(r, a)[0] > 1, constant(type), leaf(type, at));
    default:
      return min(argmin(r, a)[1], converted(type, Expr(9.0f)));
  }
}

void Maker::add_func(int dimensions) {
  budget_ = 12;
  Func f("f" + std::to_string(p_.funcs.size()));
  const std::vector<Var> vars = first_variables(dimensions);
  Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
  std::vector<Expr> values;
  for (int n = c_.chance(25) ? 2 : 1; n > 0; --n)
    values.push_back(value(value_type(), at, c_.between(0, 3)));
  f(vars) = Tuple(values);
  for (int n = c_.between(0, 3); n > 0; --n) add_update(f, vars);
  p_.funcs.push_back(f);
}

// Of the variable of dimension d itself, or where the domain or data say.
Expr Maker::write_place(const RDom& r, size_t d, const std::vector<Var>& vars) {
  std::vector<Expr> all;
  for (int k = 0; r.defined() && k < r.dimensions(); ++k) all.push_back(r[k]);
  if (all.empty()) return c_.chance(60) ? Expr(vars[d]) : Expr(c_.around_zero(4));
  const Expr u = all[std::min(d, all.size() - 1)];
  switch (c_.below(8)) {
    case 0:
    case 1:
    case 2:
      return u;
    case 3:
      return vars[d];
    case 4:
      return Expr(c_.around_zero(4));
    case 5:
      return places_.by_data(u, natural_size);
    default:
      return places_.near(u, all);
  }
}

void Maker::add_update(Func& f, const std::vector<Var>& vars) {
  budget_ = 8;
  RDom r;
  if (c_.chance(80)) r = domain(2);
  Point at;
  at.self = f;
  for (size_t d = 0; d < vars.size(); ++d) {
    at.write.push_back(write_place(r, d, vars));
    at.is_pure.push_back(
        at.write[d].same_as(vars[d]) ||
        (at.write[d].as<ir::Variable>() && at.write[d].as<ir::Variable>()->name == vars[d].name()));
    if (at.is_pure[d]) at.all.push_back(vars[d]);
  }
  for (int k = 0; r.defined() && k < r.dimensions(); ++k) at.all.push_back(r[k]);
  std::vector<Expr> values;
  for (int k = 0; k < f.outputs(); ++k) values.push_back(updated(f, k, at));
  f(at.write) = Tuple(values);
}

Expr Maker::updated(const Func& f, int k, const Point& at) {
  const Type type = f.types()[static_cast<size_t>(k)];
  const Expr self = f(at.write).element(k);
  const int depth = c_.between(0, 2);
  switch (c_.below(10)) {
    case 0:
      return value(type, at, depth);
    case 1:
      return self + value(type, at, depth);
    case 2:
      return self;
    case 3:
      return self * converted(type, Expr(0.5f)) + value(type, at, depth);
    case 4:
      return self * value(type, at, depth);
    case 5:
      return c_.chance(50) ? max(self, value(type, at, depth)) : min(self, value(type, at, depth));
    case 6:
      return select(places_.condition(at.all), self, value(type, at, depth));
    case 7:
      return select(places_.condition(at.all), value(type, at, depth), undef(type));
    case 8:
      return f(at.write).element(f.outputs() - 1 - k).type() == type
                 ? f(at.write).element(f.outputs() - 1 - k) + value(type, at, 0)
                 : self;
    default:
      return converted(type, read_self(at)) * converted(type, weight()) + value(type, at, depth);
  }
}

void Maker::add_chain() {
  for (int n = c_.between(4, 12); n > 0; --n) {
    Func f("c" + std::to_string(p_.funcs.size()));
    const Func& before = p_.funcs.back();
    const std::vector<Var> vars = first_variables(before.dimensions());
    Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
    const Expr last = converted(Float(32), before(vars).element(0));
    f(vars) = sin(last) + 0.25f * leaf(Float(32), at);
    p_.funcs.push_back(f);
  }
}

// Reads the Func before it, so that something is connected; a float at least.
void Maker::add_output() {
  Func f("out");
  const std::vector<Var> vars = first_variables(c_.between(1, 2));
  Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
  const Func& last = p_.funcs.back();
  std::vector<Expr> place;
  for (int d = 0; d < last.dimensions(); ++d)
    place.push_back(d < static_cast<int>(vars.size()) ? Expr(vars[static_cast<size_t>(d)])
                                                      : Expr(1));
  Expr result = converted(Float(32), last(place).element(0));
  if (last.outputs() == 2) result = result + converted(Float(32), last(place).element(1)) * result;
  budget_ = 6;
  if (c_.chance(50)) result = result * leaf(Float(32), at);
  std::vector<Expr> values{result};
  for (int n = c_.chance(25) ? c_.between(1, 2) : 0; n > 0; --n)
    values.push_back(value(value_type(), at, 1));
  f(vars) = Tuple(values);
  if (c_.chance(30)) add_update(f, vars);
  p_.funcs.push_back(f);
}

}  // namespace retrograde::gradient
