// Funcs, their updates and reductions.
#include "frontend/language/inline_reductions.h"
#include "ir/build.h"
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

std::vector<Var> first_variables(int dimensions) {
  const std::vector<Var> all{Var("x"), Var("y"), Var("z")};
  return {all.begin(), all.begin() + dimensions};
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

void Maker::choose_predicate(RDom& r, const Point& at) {
  if (!c_.chance(30)) return;
  Point plain = at;  // does not read the updated Func
  plain.write.clear();
  plain.may_reduce = false;
  r.where(c_.chance(75)     ? place_condition(plain.all)
          : s_.has_integers ? value(Bool(), plain, c_.between(1, 2))
                            : leaf(Float(32), plain) > 0.75f);
}

Expr Maker::reduced(const Type& type, const Point& at, int depth) {
  RDom r(ranges(s_.has_integers ? 2 : 1));
  // An inline reduction becomes a Func, so it must not read an unfinished one.
  Point inner{at.all, {}, Func(), {}, !s_.has_integers};
  for (int d = 0; d < r.dimensions(); ++d) inner.all.push_back(r[d]);
  const Expr a = kept_small(value(type, inner, std::min(depth - 1, 1)), 64);
  return c_.one_of<Expr>({
      [&] { return sum(r, a); },
      [&] { return is_wide(type) ? sum(r, a) : product(r, a); },
      // Over an empty domain the result is infinite.
      [&] { return max(maximum(r, a), converted(type, Expr(-9.0f))); },
      [&] { return min(minimum(r, a), converted(type, Expr(9.0f))); },
      [&] {
        const Expr at_most = argmax(r, a)[c_.below(r.dimensions())];
        return c_.chance(30) ? converted(type, at_most)
                             : select(at_most > 1, constant(type), leaf(type, at));
      },
      [&] {
        return min(argmin(r, a)[static_cast<size_t>(r.dimensions())], converted(type, Expr(9.0f)));
      },
  });
}

void Maker::finish(const Func& f) {
  p_.funcs.push_back(f);
  inlined_reads_.push_back(1 + reads_);
  reads_ = 0;
}

void Maker::add_func(int dimensions) {
  budget_ = 12;
  Func f("f" + std::to_string(p_.funcs.size()));
  const std::vector<Var> vars = first_variables(dimensions);
  Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
  std::vector<Expr> values;
  for (int n = c_.chance(25) ? 2 : 1; n > 0; --n)
    values.push_back(
        kept_small(value(c_.pick(s_.value_types), at, c_.between(0, 3)), wide_modulus));
  f(vars) = Tuple(values);
  for (int n = c_.between(s_.least_updates, 3); n > 0; --n) add_update(f, vars);
  finish(f);
}

// The index to write: the dimension's own variable, or one that depends on the domain or on data.
Expr Maker::write_place(const RDom& r, size_t d, const std::vector<Var>& vars) {
  std::vector<Expr> all;
  for (int k = 0; r.defined() && k < r.dimensions(); ++k) all.push_back(r[k]);
  const auto fixed = [&] {
    const int place = c_.around_zero(4);
    if (is_output_) reaches_.push_back({d, place - 1, place});
    return Expr(place);
  };
  if (all.empty()) return c_.chance(60) ? Expr(vars[d]) : fixed();
  const auto k = static_cast<int>(std::min(d, all.size() - 1));
  const Expr u = all[static_cast<size_t>(k)];
  return c_.one_of<Expr>({
      [&] { return is_output_ ? reached(r[k], d) : u; },
      [&] { return is_output_ ? reached(r[k], d) : u; },
      [&] { return is_output_ ? reached(r[k], d) : u; },
      [&] { return vars[d]; },
      [&] { return fixed(); },
      [&] {
        if (is_output_) reaches_.push_back({d, -1, natural_size - 1});
        return by_data(u, natural_size);
      },
      [&] { return is_output_ ? Expr(vars[d]) : near(u, all); },
      [&] { return is_output_ ? Expr(vars[d]) : near(u, all); },
  });
}

// An index near the variable, from whose extent the accessed region follows; the previous step is read, too.
Expr Maker::reached(const RVar& r, size_t d) {
  const auto min = ir::as_const_int(r.min()), extent = ir::as_const_int(r.extent());
  const int first = static_cast<int>(min.value_or(0)) + c_.around_zero(2),
            last = first + static_cast<int>(extent.value_or(s_.largest_image)) - 1;
  reaches_.push_back({d, first - 1, last});
  return min.value_or(0) == first ? Expr(r) : r + (first - static_cast<int>(min.value_or(0)));
}

void Maker::add_update(Func& f, const std::vector<Var>& vars) {
  budget_ = 8;
  RDom r;
  if (c_.chance(80)) r = RDom(ranges(2));
  Point at;
  at.self = f;
  at.may_reduce = !s_.has_integers;
  for (size_t d = 0; d < vars.size(); ++d) {
    at.write.push_back(write_place(r, d, vars));
    const auto* variable = at.write[d].as<ir::Variable>();
    at.is_pure.push_back(variable && variable->name == vars[d].name());
    if (at.is_pure[d]) at.all.push_back(vars[d]);
  }
  for (int k = 0; r.defined() && k < r.dimensions(); ++k) at.all.push_back(r[k]);
  if (r.defined()) choose_predicate(r, at);
  std::vector<Expr> values;
  if (f.outputs() == 2 && c_.chance(25)) values = updated_together(f, at);
  for (int k = 0; k < f.outputs() && values.size() < f.types().size(); ++k)
    values.push_back(updated(f, k, at));
  f(at.write) = Tuple(values);
}

// A value to update with.
Expr Maker::fresh(const Type& type, const Point& at, int depth) {
  return kept_small(value(type, at, depth), 64);
}

// Two coupled values: the product of complex numbers, or the largest value so far with a value that belongs to it.
std::vector<Expr> Maker::updated_together(const Func& f, const Point& at) {
  const Type type = f.types()[0], other = f.types()[1];
  const Expr a = f(at.write).element(0), b = f(at.write).element(1);
  const Expr c = fresh(type, at, c_.between(0, 2)), d = fresh(other, at, c_.between(0, 1));
  if (type.is_bool()) return {a || c, d};
  if (type == other && !is_wide(type) && c_.chance(50)) return {a * c - b * d, a * d + b * c};
  return {select(a < c, c, a), select(a < c, d, b)};
}

Expr Maker::updated(const Func& f, int k, const Point& at) {
  const Type type = f.types()[static_cast<size_t>(k)];
  const Expr self = f(at.write).element(k), other = f(at.write).element(f.outputs() - 1 - k);
  const int depth = c_.between(0, 2);
  // Sums stay small; bools are not multiplied.
  const bool only_adds = s_.has_integers && (is_wide(type) || type.is_bool());
  const auto scaled = [&](const Expr& e, const Expr& by) { return only_adds ? e : e * by; };
  return c_.one_of<Expr>({
      [&] { return fresh(type, at, depth); },
      [&] { return sum_of(self, fresh(type, at, depth)); },
      [&] { return s_.has_integers ? sum_of(self, fresh(type, at, depth)) : self; },
      [&] { return sum_of(scaled(self, converted(type, Expr(0.5f))), fresh(type, at, depth)); },
      [&] {
        return only_adds ? sum_of(self, fresh(type, at, depth)) : self * fresh(type, at, depth);
      },
      [&] {
        if (type.is_bool()) return self && fresh(type, at, depth);
        return c_.chance(50) ? max(self, fresh(type, at, depth))
                             : min(self, fresh(type, at, depth));
      },
      [&] { return select(place_condition(at.all), self, fresh(type, at, depth)); },
      // Machine code stores all values of a Tuple, or none.
      [&] {
        return select(place_condition(at.all), fresh(type, at, depth),
                      s_.has_runs && f.outputs() > 1 ? self : undef(type));
      },
      [&] { return other.type() == type ? sum_of(other, fresh(type, at, 0)) : self; },
      [&] {
        return sum_of(scaled(converted(type, read_self(at)), converted(type, weight())),
                      fresh(type, at, depth));
      },
  });
}

void Maker::add_sine() {
  Func f("c" + std::to_string(p_.funcs.size()));
  const Func& before = p_.funcs.back();
  const std::vector<Var> vars = first_variables(before.dimensions());
  Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
  const Expr last = converted(Float(32), before(vars).element(0));
  f(vars) = sin(last) + 0.25f * leaf(Float(32), at);
  finish(f);
}

// A stencil of the previous Func, of its type; some at half or twice the resolution. The first one reads an image.
void Maker::add_stencil() {
  Func f("s" + std::to_string(p_.funcs.size()));
  const bool is_first = p_.funcs.empty();
  const std::vector<Var> vars =
      first_variables(is_first ? c_.between(1, 2) : p_.funcs.back().dimensions());
  Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
  if (is_first) {
    f(vars) = kept_small(read_image(at), wide_modulus);
    return finish(f);
  }
  const Func before = p_.funcs.back();
  const int reads = c_.between(2, 3), along = c_.below(before.dimensions());
  const bool halves = c_.chance(20), doubles = !halves && c_.chance(15);
  Expr result;
  for (int i = 0; i < reads; ++i) {
    std::vector<Expr> place(vars.begin(), vars.end());
    for (size_t d = 0; d < place.size(); ++d) {
      if (static_cast<int>(d) != along && !c_.chance(20)) continue;
      place[d] = (halves ? 2 * vars[d] : doubles ? vars[d] / 2 : Expr(vars[d])) + (i - c_.below(2));
    }
    const Expr read = before(place);
    result = i == 0 ? read : c_.chance(75) ? result + read : max(result, read);
  }
  f(vars) = kept_small(c_.chance(50) ? result / cast(result.type(), reads) : result, wide_modulus);
  finish(f);
}

// The output reads the previous Func, so that the program is connected; at least one value is a float, for gradients.
void Maker::add_output() {
  Func f("out");
  const std::vector<Var> vars = first_variables(c_.between(1, s_.has_runs ? 3 : 2));
  Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
  const Func last = p_.funcs.back();
  const std::vector<Expr> place = ir::numbered(last.dimensions(), [&](int d) {
    return d < static_cast<int>(vars.size()) ? Expr(vars[static_cast<size_t>(d)]) : Expr(1);
  });
  const Type type = s_.has_integers ? c_.pick(s_.value_types) : Float(32);
  Expr result = converted(type, last(place).element(0));
  if (last.outputs() == 2 && type.is_float())
    result = result + converted(type, last(place).element(1)) * result;
  budget_ = 6;
  if (c_.chance(50))
    result = s_.has_integers ? sum_of(result, value(type, at, 2)) : result * leaf(type, at);
  std::vector<Expr> values{kept_small(result, wide_modulus)};
  for (int n = c_.chance(25) ? c_.between(1, 2) : 0; n > 0; --n)
    values.push_back(kept_small(value(c_.pick(s_.value_types), at, 1), wide_modulus));
  f(vars) = Tuple(values);
  is_output_ = s_.has_runs;
  for (int n = c_.chance(30) ? (s_.has_runs ? c_.between(1, 2) : 1) : 0; n > 0; --n)
    add_update(f, vars);
  is_output_ = false;
  finish(f);
  p_.outputs = {f};
}

// ---- loops over time, for checkpoints ----

// The outermost reduction variable is the step, which computes a state from the previous one.

// A state with the dimensions of f, or one over which a second reduction variable runs.
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
  if (c_.chance(15)) r.where(place_condition({r[r.dimensions() - 1]}));
  at.self = f;
  at.write.assign(vars.begin(), vars.end());
  at.is_pure.assign(vars.size(), true);
  if (runs_through) {
    at.write[0] = at.all[0] = r.x;
    at.is_pure[0] = false;
  }
  at.all.push_back(r[r.dimensions() - 1]);
  const auto next = ir::numbered(f.outputs(), [&](int k) { return stepped(f, k, at); });
  f(at.write) = Tuple(next);
  finish(f);
  p_.has_loop = true;
}

// A step whose result stays bounded after any number of steps.
Expr Maker::stepped(const Func& f, int k, const Point& at) {
  const Expr self = f(at.write).element(k), other = f(at.write).element(f.outputs() - 1 - k);
  const Expr input = value(Float(32), at, 1);
  return c_.one_of<Expr>({
      [&] { return self * 0.75f + input; },
      [&] { return sin(self + input); },
      [&] { return self * (1.5f - self * self * 0.5f) + input * 0.125f; },
      [&] { return tanh(other * input + self); },
      [&] { return (self + converted(Float(32), read_self(at))) * 0.5f + input * 0.25f; },
      [&] { return max(self * 0.5f, input); },
      [&] { return select(place_condition(at.all), self, cos(self) * input); },
  });
}

}  // namespace retrograde::fuzz
