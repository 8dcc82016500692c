#include "gradient/adversary/program.h"

#include "frontend/boundary_conditions.h"
#include "frontend/inline_reductions.h"
#include "gradient/adversary/places.h"

namespace retrograde::gradient {

namespace {

// The coordinates of a point, and the Func that is being updated there.
struct Point {
  std::vector<Expr> all;    // pure variables, then reduction variables
  std::vector<Expr> write;  // where the update writes
  Func self;
  std::vector<bool> is_pure;  // dimensions of `self` that the update leaves alone
  bool in_update() const { return !write.empty(); }
};

class Maker {
 public:
  Maker(Choices& choices, AdversaryProgram& program)
      : c_(choices), p_(program), places_(choices, program.data, program.count) {}

  void run() {
    make_inputs();
    for (int n = c_.between(1, 4); n > 0; --n) add_func(c_.between(1, 2));
    if (c_.chance(10)) add_chain();
    if (c_.chance(8)) add_func(3);
    add_output();
    for (int d = 0; d < p_.output().dimensions(); ++d) {
      p_.region.mins.push_back(c_.chance(20) ? c_.around_zero(2) : 0);
      p_.region.extents.push_back(c_.chance(10) ? c_.between(1, 3) : natural_size);
    }
    p_.options.overwritten = c_.chance(25) ? Overwritten::Error : Overwritten::Store;
    p_.only_inputs = c_.chance(40);
  }

 private:
  // ---- inputs ----

  Type image_type() {
    switch (c_.below(12)) {
      case 10:
        return Float(64);
      case 11:
        return Float(16);
      default:
        return Float(32);
    }
  }

  void make_inputs() {
    p_.data = Buffer<int>(std::vector<int>{8}, "data");
    p_.data.get()->for_each_value([&](int& v) { v = c_.between(0, 7) - 1; });
    p_.scale.set(0.75f);
    p_.count.set(c_.between(1, 4));
    for (int n = c_.between(1, 2); n > 0; --n) {
      std::vector<int> sizes{c_.between(natural_size, 7)};
      if (c_.chance(50)) sizes.push_back(natural_size);
      Buffer<> image(image_type(), sizes, "image" + std::to_string(p_.images.size()));
      fill(image, c_.chance(15));
      p_.images.push_back(image);
    }
  }

  // In [0.25, 1.25], so that a step of 2^-9 to either side is exact in the type; ties: few values.
  void fill(Buffer<>& image, bool ties) {
    const halide_buffer_t& raw = *image.raw_buffer();
    const Type type = oracle::type_of_buffer(raw);
    const int steps = ties ? 3 : type.bits() == 16 ? 32 : 4096;
    std::mt19937 random(static_cast<unsigned>(c_.below(1 << 16)));
    oracle::region_of(raw).for_each([&](const std::vector<int>& at) {
      const double value = 0.25 + (random() % static_cast<unsigned>(steps)) / double(steps);
      oracle::write_element(*image.raw_buffer(), at, ir::Scalar::of_float(type, value));
    });
  }

  // ---- values ----

  float weight() { return static_cast<float>(c_.around_zero(6)) / 8.0f + 0.0625f; }
  static Expr converted(const Type& type, const Expr& e) {
    if (e.type() == type) return e;
    if (e.type().is_float() && !type.is_float())  // outside of the type's range casts are undefined
      return cast(type, clamp(e, type.is_uint() ? 0.0f : -100.0f, 100.0f));
    return cast(type, e);
  }
  Expr constant(const Type& type) { return converted(type, Expr(0.5f + weight())); }
  const Func& any_func() {
    return p_.funcs[static_cast<size_t>(c_.below(static_cast<int>(p_.funcs.size())))];
  }
  static Expr any_value(Choices& c, const FuncRef& ref) {
    return ref.element(c.below(static_cast<int>(ref.size())));
  }

  Expr read_image(const Point& at) {
    Buffer<>& image = p_.images[static_cast<size_t>(c_.below(static_cast<int>(p_.images.size())))];
    std::vector<Expr> place;
    if (c_.chance(30)) {
      for (int d = 0; d < image.dimensions(); ++d)
        place.push_back(places_.near(coordinate(at, d), at.all));
      return bounded(image)(place);
    }
    for (int d = 0; d < image.dimensions(); ++d)
      place.push_back(places_.inside(coordinate(at, d), at.all, image.extent(d)));
    return image(place);
  }
  Func bounded(const Buffer<>& image) {
    using namespace BoundaryConditions;
    const Expr outside = cast(oracle::type_of_buffer(*image.raw_buffer()), Expr(0.5f));
    switch (c_.below(5)) {
      case 0:
        return repeat_edge(image);
      case 1:
        return constant_exterior(image, outside);
      case 2:
        return repeat_image(image);
      case 3:
        return mirror_image(image);
      default:
        return mirror_interior(image);
    }
  }
  Expr coordinate(const Point& at, int d) {
    if (at.all.empty()) return Expr(c_.between(0, 3));
    if (d < static_cast<int>(at.all.size()) && !c_.chance(25))
      return at.all[static_cast<size_t>(d)];
    return at.all[static_cast<size_t>(c_.below(static_cast<int>(at.all.size())))];
  }
  Expr read_func(const Point& at) {
    if (p_.funcs.empty()) return read_image(at);
    const Func& f = any_func();
    std::vector<Expr> place;
    for (int d = 0; d < f.dimensions(); ++d)
      place.push_back(places_.near(coordinate(at, d), at.all));
    return any_value(c_, f(place));
  }
  // The Func that is being updated, where it is written or elsewhere.
  Expr read_self(const Point& at) {
    std::vector<Expr> place = at.write;
    const bool elsewhere = c_.chance(60);
    for (size_t d = 0; d < place.size() && elsewhere; ++d) {
      if (!at.is_pure[d])
        place[d] = places_.near(c_.chance(30) ? coordinate(at, int(d)) : place[d], at.all);
    }
    return any_value(c_, at.self(place));
  }

  Expr leaf(const Type& type, const Point& at) {
    if (at.in_update() && c_.chance(35)) return converted(type, read_self(at));
    switch (c_.below(8)) {
      case 0:
        return constant(type);
      case 1:
      case 2:
      case 3:
        return converted(type, read_image(at));
      case 4:
        return converted(type, p_.scale);
      case 5:  // by a Param: where inversion fixes the coordinate, functions of it alone would be
               // folded in float32, which the checks in double take for an error
        return at.all.empty() ? constant(type)
                              : converted(type, cast<float>(coordinate(at, 0)) * p_.scale * 0.125f);
      default:
        return converted(type, read_func(at));
    }
  }

  Expr value(const Type& type, const Point& at, int depth) {
    if (depth <= 0 || --budget_ < 0) return leaf(type, at);
    if (!type.is_float()) return integer(type, at, depth);
    switch (c_.below(10)) {
      case 0:
      case 1:
        return leaf(type, at);
      case 2:
        return value(type, at, depth - 1) + value(type, at, depth - 1);
      case 3:
        return value(type, at, depth - 1) * converted(type, weight());
      case 4:
        return value(type, at, depth - 1) * value(type, at, depth - 1);
      case 5:
      case 6:
        return smooth(type, at, depth);
      case 7:
        return broken(type, at, depth);
      case 8:
        return guarded(type, at, depth);
      default:
        return reduced(type, at, depth);
    }
  }

  Expr integer(const Type& type, const Point& at, int depth) {
    if (type.is_bool()) return value(Float(32), at, depth - 1) > 0.75f;
    switch (c_.below(3)) {
      case 0:
        return converted(type, places_.by_data(coordinate(at, 0), natural_size));
      case 1:
        return converted(type, value(Float(32), at, depth - 1) * 4.0f);
      default:
        return converted(type, select(places_.condition(at.all), 1, 3));
    }
  }

  Expr smooth(const Type& type, const Point& at, int depth) {
    const Expr a = value(type, at, depth - 1);
    auto one = [&](double v) { return cast(type, Expr(v)); };
    switch (c_.below(15)) {
      case 0:
        return sin(a);
      case 1:
        return a - value(type, at, depth - 1);
      case 2:
        return a / (one(1.5) + cos(value(type, at, depth - 1)));
      case 3:
        return exp(-(a * a));
      case 4:
        return tanh(a);
      case 5:
        return atan2(a, value(type, at, depth - 1));
      case 6:
        return hypot(a, value(type, at, depth - 1));
      case 7:
        return lerp(a, value(type, at, depth - 1), value(type, at, depth - 1));
      case 8:
        return log(one(1.5) + a * a);
      case 9:
        return sqrt(a * a + one(0.5));
      case 10:
        return pow(one(1) + a * a, value(type, at, depth - 1));
      case 11:
        return pow(a, c_.between(0, 3));
      case 12:
        return one(1) / (one(1) + exp(-a));
      case 13:
        return erf(a);
      default:
        return -a;
    }
  }

  // Kinks and jumps.
  Expr broken(const Type& type, const Point& at, int depth) {
    const Expr a = value(type, at, depth - 1);
    switch (c_.below(12)) {
      case 0:
        return max(a, value(type, at, depth - 1));
      case 1:
        return min(a, value(type, at, depth - 1));
      case 2:
        return max(a, a);
      case 3:
        return abs(a - constant(type));
      case 4:
        return clamp(a, constant(type), converted(type, Expr(1.0f)));
      case 5:
        return converted(type, cast<int>(clamp(a, converted(type, Expr(-9.0f)),
                                               converted(type, Expr(9.0f))) *
                                         3)) *
               leaf(type, at);
      case 6:
        return a - floor(a);
      case 7:
        return a % converted(type, Expr(0.75f));
      case 8:
        return converted(type, cast(Float(c_.chance(50) ? 64 : 16), a));
      case 9:
        return absd(a, value(type, at, depth - 1));
      case 10:
        return select(a > leaf(type, at), a, value(type, at, depth - 1));
      default:
        return stop_at_integer(type, a);
    }
  }
  static Expr stop_at_integer(const Type& type, const Expr& a) {
    return a + cast(type, cast<uint8_t>(clamp(a, cast(type, Expr(0.0f)), cast(type, Expr(9.0f)))));
  }

  // Branches that are NaN or infinite where they are not taken, or are chosen by place.
  Expr guarded(const Type& type, const Point& at, int depth) {
    const Expr a = value(type, at, depth - 1);
    auto one = [&](double v) { return cast(type, Expr(v)); };
    switch (c_.below(9)) {
      case 0:
        return select(places_.condition(at.all), a, value(type, at, depth - 1));
      case 1:
        return select(a > one(0.75), sqrt(a - one(0.75)), a);
      case 2:
        return select(a > one(0), log(a), a * one(2));
      case 3:
        return select(abs(a) < one(0.125), one(1), sin(a) / a);
      case 4:
        return select(a < one(1), acos(a) * one(0), a * a);
      case 5:
        return select(a == one(0), one(0), one(1) / a);
      case 6:
        return sqrt(max(a, one(0)));
      case 7:
        return mux(places_.by_data(coordinate(at, 0), 3), {a, leaf(type, at), constant(type)});
      default:
        return select(places_.condition(at.all) && a > one(0.5), a * a, pow(a, one(0.5)));
    }
  }

  // ---- reductions ----

  Region ranges(int most) {
    Region result;
    for (int n = c_.between(1, most); n > 0; --n) {
      const int low = c_.chance(30) ? c_.around_zero(3) : 0;
      Expr extent = c_.chance(12)   ? Expr(p_.count)
                    : c_.chance(12) ? Expr(c_.below(2))
                                    : Expr(c_.between(2, natural_size));
      result.push_back({Expr(low), extent});
    }
    return result;
  }
  RDom domain(int most) {
    RDom r(ranges(most));
    if (!c_.chance(30)) return r;
    std::vector<Expr> all;
    for (int d = 0; d < r.dimensions(); ++d) all.push_back(r[d]);
    Point at{all, {}, Func(), {}};
    r.where(c_.chance(25) ? leaf(Float(32), at) > 0.75f : places_.condition(all));
    return r;
  }

  Expr reduced(const Type& type, const Point& at, int depth) {
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

  // ---- Funcs ----

  static std::vector<Var> variables(int dimensions) {
    const std::vector<Var> all{Var("x"), Var("y"), Var("z")};
    return {all.begin(), all.begin() + dimensions};
  }

  Type value_type() {
    switch (c_.below(20)) {
      case 15:
      case 16:
        return Float(64);
      case 17:
        return Float(16);
      case 18:
        return Int(32);
      case 19:
        return UInt(8);
      default:
        return Float(32);
    }
  }

  void add_func(int dimensions) {
    budget_ = 12;
    Func f("f" + std::to_string(p_.funcs.size()));
    const std::vector<Var> vars = variables(dimensions);
    Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
    std::vector<Expr> values;
    for (int n = c_.chance(25) ? 2 : 1; n > 0; --n)
      values.push_back(value(value_type(), at, c_.between(0, 3)));
    f(vars) = Tuple(values);
    for (int n = c_.between(0, 3); n > 0; --n) add_update(f, vars);
    p_.funcs.push_back(f);
  }

  // Of the variable of dimension d itself, or where the domain or data say.
  Expr write_place(const RDom& r, size_t d, const std::vector<Var>& vars) {
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

  void add_update(Func& f, const std::vector<Var>& vars) {
    budget_ = 8;
    RDom r;
    if (c_.chance(80)) r = domain(2);
    Point at;
    at.self = f;
    for (size_t d = 0; d < vars.size(); ++d) {
      at.write.push_back(write_place(r, d, vars));
      at.is_pure.push_back(at.write[d].same_as(vars[d]) ||
                           (at.write[d].as<ir::Variable>() &&
                            at.write[d].as<ir::Variable>()->name == vars[d].name()));
      if (at.is_pure[d]) at.all.push_back(vars[d]);
    }
    for (int k = 0; r.defined() && k < r.dimensions(); ++k) at.all.push_back(r[k]);
    std::vector<Expr> values;
    for (int k = 0; k < f.outputs(); ++k) values.push_back(updated(f, k, at));
    f(at.write) = Tuple(values);
  }

  Expr updated(const Func& f, int k, const Point& at) {
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
        return c_.chance(50) ? max(self, value(type, at, depth))
                             : min(self, value(type, at, depth));
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

  void add_chain() {
    for (int n = c_.between(4, 12); n > 0; --n) {
      Func f("c" + std::to_string(p_.funcs.size()));
      const Func& before = p_.funcs.back();
      const std::vector<Var> vars = variables(before.dimensions());
      Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
      const Expr last = converted(Float(32), before(vars).element(0));
      f(vars) = sin(last) + 0.25f * leaf(Float(32), at);
      p_.funcs.push_back(f);
    }
  }

  // Reads the Func before it, so that something is connected; a float at least.
  void add_output() {
    Func f("out");
    const std::vector<Var> vars = variables(c_.between(1, 2));
    Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
    const Func& last = p_.funcs.back();
    std::vector<Expr> place;
    for (int d = 0; d < last.dimensions(); ++d)
      place.push_back(d < static_cast<int>(vars.size()) ? Expr(vars[static_cast<size_t>(d)])
                                                        : Expr(1));
    Expr result = converted(Float(32), last(place).element(0));
    if (last.outputs() == 2)
      result = result + converted(Float(32), last(place).element(1)) * result;
    budget_ = 6;
    if (c_.chance(50)) result = result * leaf(Float(32), at);
    std::vector<Expr> values{result};
    if (c_.chance(15)) values.push_back(value(value_type(), at, 1));
    f(vars) = Tuple(values);
    if (c_.chance(30)) add_update(f, vars);
    p_.funcs.push_back(f);
  }

  Choices& c_;
  AdversaryProgram& p_;
  Places places_;
  int budget_ = 0;
};

}  // namespace

AdversaryProgram make_program(Choices& choices) {
  AdversaryProgram program;
  Maker(choices, program).run();
  return program;
}

}  // namespace retrograde::gradient
