#include "gradient/adversary/check.h"

#include <cmath>
#include <cstring>

#include "autodiff/regions.h"
#include "autodiff/tangents.h"
#include "diagnostics/error.h"
#include "frontend/realization.h"
#include "ir/build.h"
#include "simplify/simplify.h"
#include "testing/interpreter.h"

namespace retrograde::gradient {

namespace {

constexpr size_t max_points = size_t{1}
                              << 17;  // of one Func; a program that needs more is passed over
constexpr double step = 1.0 / 128;
constexpr size_t longest_detail = 600;  // internal errors carry whole programs

// Ends the judgement.
struct Verdict {
  Judged judged;
};
[[noreturn]] void decide(Judgement judgement, const std::string& detail) {
  throw Verdict{{judgement, detail}};
}

// sum a * b, and of the magnitudes.
struct Product {
  double sum = 0, magnitude = 0;
  void add(double a, double b) {
    sum += a * b;
    magnitude += std::abs(a * b);
  }
  bool is_finite() const { return std::isfinite(sum) && std::isfinite(magnitude); }
};

double as_double(const oracle::Value& v) { return v.is_undef() ? 0.0 : v.scalar.as_double(); }

std::vector<oracle::Array> interpret(const Func& f, const oracle::Region& region) {
  oracle::InterpreterOptions options;
  options.widen = true;
  options.max_points = max_points;
  return oracle::Interpreter(options).realize(f.function(), region);
}

// Of what was synthesized: when the program can be evaluated, its derivative can.
std::vector<oracle::Array> evaluate(const Func& f, const oracle::Region& region) {
  try {
    return interpret(f, region);
  } catch (const UserError& error) {
    const std::string message = error.what();
    const bool is_large = message.find("points") != std::string::npos;
    decide(is_large ? Judgement::Illegal : Judgement::Wrong, f.name() + " " + message);
  }
}

// Weights of all values of a box, none of them 0: odd multiples of 1/4 up to 7/4.
class Weights {
 public:
  explicit Weights(uint64_t seed) : random_(seed) {}
  float next() { return (2.0f * static_cast<float>(random_() % 4) + 1.0f) * sign() / 4.0f; }
  float sign() { return random_() % 2 ? 1.0f : -1.0f; }
  Buffer<float> over(const oracle::Region& region, const std::string& name) {
    Buffer<float> result(region.extents, name);
    result.set_min(region.mins);
    result.get()->for_each_value([&](float& v) { v = next(); });
    return result;
  }

 private:
  std::mt19937_64 random_;
};

// A Func that reads one buffer for each value.
Func reading(const std::vector<Buffer<float>>& buffers, const std::string& name) {
  std::vector<Var> vars;
  for (int d = 0; d < buffers[0].dimensions(); ++d) vars.push_back(Var::implicit(d));
  std::vector<Expr> place(vars.begin(), vars.end()), values;
  for (const Buffer<float>& b : buffers) values.push_back(b(place));
  Func f(name);
  f(vars) = Tuple(values);
  return f;
}

class Judge {
 public:
  Judge(const AdversaryProgram& program, uint64_t seed, bool machine_code)
      : p_(program), weights_(seed), machine_code_(machine_code) {}

  void run() {
    for (int k = 0; k < p_.output().outputs(); ++k)
      w_.push_back(weights_.over(p_.region, "w" + std::to_string(k)));
    choose_directions();
    at_rest_ = primal("it");
    if (!std::isfinite(at_rest_)) decide(Judgement::Illegal, "its value is not finite");
    differentiate();
    compare_with_tangents();
    if (!p_.only_inputs) compare_along_func();
    const bool is_smooth = compare_with_differences();
    if (machine_code_) compare_machine_code();
    if (!is_smooth) decide(Judgement::Kink, "");
  }

 private:
  // ---- the primal ----

  // sum w * output in double. A program that cannot be evaluated is not legal.
  double primal(const char* what) {
    try {
      Product sum;
      const auto arrays = interpret(p_.output(), p_.region);
      for (size_t k = 0; k < arrays.size(); ++k) {
        if (!arrays[k].type.is_float()) continue;
        size_t i = 0;
        p_.region.for_each([&](const std::vector<int>& at) {
          sum.add(as_double(arrays[k].values[i++]), w_[k].get()->operator()(at.data()));
        });
      }
      largest_ = std::max(largest_, sum.magnitude);
      return sum.sum;
    } catch (const InternalError&) {
      throw;
    } catch (const std::exception& error) {
      decide(Judgement::Illegal, std::string(what) + " cannot be evaluated: " + error.what());
    }
  }

  // Signs; of integers none.
  void choose_directions() {
    for (const Buffer<>& image : p_.images)
      v_.push_back(weights_.over(oracle::region_of(*image.raw_buffer()), image.name() + "_v"));
    for (Buffer<float>& v : v_) v.get()->for_each_value([&](float& x) { x = weights_.sign(); });
    v_scale_ = weights_.sign();
  }

  void move(double by) {
    for (size_t i = 0; i < p_.images.size(); ++i) {
      halide_buffer_t& raw = *const_cast<Buffer<>&>(p_.images[i]).raw_buffer();
      oracle::region_of(raw).for_each([&](const std::vector<int>& at) {
        ir::Scalar value = oracle::read_element(raw, at);
        value.f += by * static_cast<double>(v_[i].get()->operator()(at.data()));
        oracle::write_element(raw, at, value);
      });
    }
    const_cast<Param<float>&>(p_.scale).set(p_.scale.get() + static_cast<float>(by) * v_scale_);
  }
  double primal_at(double by) {
    move(by);
    const double result = primal("a neighbour of it");
    move(-by);
    return result;
  }

  // ---- the derivative ----

  Region bounds() const {
    Region result;
    for (size_t d = 0; d < p_.region.mins.size(); ++d)
      result.push_back({Expr(p_.region.mins[d]), Expr(p_.region.extents[d])});
    return result;
  }

  void differentiate() {
    AdjointOptions options = p_.options;
    if (p_.only_inputs) {
      for (const Buffer<>& image : p_.images) options.wrt.push_back(image);
      options.wrt.push_back(p_.scale);
    }
    derivative_.emplace(propagate_adjoints(p_.output(), reading(w_, "w"), bounds(), options));
    for (size_t i = 0; i < p_.images.size(); ++i) {
      oracle::Region region = oracle::region_of(*p_.images[i].raw_buffer());
      add_product((*derivative_)(p_.images[i]), region, v_[i]);
    }
    const Func of_scale = (*derivative_)(p_.scale);
    if (!of_scale.defined()) return;
    gradients_.push_back({of_scale, {}});
    reverse_.add(as_double(evaluate(of_scale, {})[0].values[0]), static_cast<double>(v_scale_));
  }

  // Adds <gradient, v>; the gradient must be 0 in a ring around the region.
  void add_product(const Func& gradient, const oracle::Region& region, const Buffer<float>& v) {
    if (!gradient.defined()) return;  // the output does not read it
    oracle::Region around = region;
    for (size_t d = 0; d < region.mins.size(); ++d) --around.mins[d], around.extents[d] += 2;
    const oracle::Array found = evaluate(gradient, around)[0];
    around.for_each([&](const std::vector<int>& at) {
      bool inside = true;
      for (size_t d = 0; d < at.size(); ++d)
        inside &= at[d] >= region.mins[d] && at[d] < region.mins[d] + region.extents[d];
      const double value = as_double(found.at(at));
      if (inside) {
        reverse_.add(value, static_cast<double>(v.get()->operator()(at.data())));
      } else if (value != 0) {
        decide(Judgement::Wrong, "the gradient is not 0 outside of " + v.name());
      }
    });
    gradients_.push_back({gradient, region});
  }

  // ---- forward mode ----

  double forward(const std::vector<Direction>& directions) {
    const Func t = propagate_tangents(p_.output(), directions)(p_.output());
    if (!t.defined()) return 0;
    const auto arrays = evaluate(t, p_.region);
    double sum = 0;
    for (size_t k = 0; k < arrays.size(); ++k) {
      if (!p_.output().types()[k].is_float()) continue;
      size_t i = 0;
      p_.region.for_each([&](const std::vector<int>& at) {
        sum += as_double(arrays[k].values[i++]) *
               static_cast<double>(w_[k].get()->operator()(at.data()));
      });
    }
    return sum;
  }

  void compare_with_tangents() {
    std::vector<Direction> directions;
    for (size_t i = 0; i < p_.images.size(); ++i) directions.emplace_back(p_.images[i], v_[i]);
    Buffer<float> along_scale = Buffer<float>::make_scalar();
    along_scale.get()->operator()() = v_scale_;
    directions.emplace_back(p_.scale, along_scale);
    compare(forward(directions), reverse_, "along the inputs");
  }
  void compare(double jv, const Product& jtw, const std::string& where) {
    const double slack = 1e-11 * (jtw.magnitude + std::abs(jv) + 1 + largest_);
    if (std::abs(jv - jtw.sum) <= slack) return;
    if (!std::isfinite(jv) && !jtw.is_finite()) return;
    decide(Judgement::Wrong,
           text("forward and reverse mode differ ", where, ": ", jv, " and ", jtw.sum));
  }

  // The adjoint of a Func against the tangent of what comes after it.
  void compare_along_func() {
    if (p_.funcs.size() < 2) return;
    const std::vector<ir::FuncPtr> order = ir::topological_order({p_.output().function()});
    const Func f = p_.funcs[static_cast<size_t>(weights_.next() > 0) * (p_.funcs.size() - 2)];
    if (std::find(order.begin(), order.end(), f.function()) == order.end()) return;
    for (const Type& t : f.types()) {
      if (!t.is_float()) return;
    }
    const std::optional<oracle::Region> region = region_of(f, order);
    const Func adjoint = derivative_->adjoint(f);
    if (!region || region->points() > 4096 || !adjoint.defined()) return;
    std::vector<Buffer<float>> directions;
    for (int k = 0; k < f.outputs(); ++k)
      directions.push_back(weights_.over(*region, "along" + std::to_string(k)));
    Product product;
    const auto arrays = evaluate(adjoint, *region);
    for (size_t k = 0; k < arrays.size(); ++k) {
      size_t i = 0;
      region->for_each([&](const std::vector<int>& at) {
        product.add(as_double(arrays[k].values[i++]),
                    static_cast<double>(directions[k].get()->operator()(at.data())));
      });
    }
    compare(forward({{f, guarded(directions, *region)}}), product, "along " + f.name());
  }
  // 0 outside of the buffers.
  static Func guarded(const std::vector<Buffer<float>>& buffers, const oracle::Region& region) {
    std::vector<Var> vars;
    std::vector<Expr> place, values;
    Expr inside = ir::const_true();
    for (size_t d = 0; d < region.mins.size(); ++d) {
      vars.push_back(Var::implicit(static_cast<int>(d)));
      const int low = region.mins[d], high = low + region.extents[d] - 1;
      inside = inside && vars.back() >= low && vars.back() <= high;
      place.push_back(clamp(vars.back(), low, high));
    }
    for (const Buffer<float>& b : buffers) values.push_back(select(inside, b(place), 0.0f));
    Func f("direction");
    f(vars) = Tuple(values);
    return f;
  }
  // What is read of f; none when it has no constant bounds or is never read.
  std::optional<oracle::Region> region_of(const Func& f,
                                          const std::vector<ir::FuncPtr>& order) const {
    ir::Box box;
    for (const Range& r : bounds()) box.push_back({r.min, ir::simplify(r.min + r.extent - 1)});
    const ir::Regions regions(order, box);
    oracle::Region region;
    for (const ir::Interval& side : regions.of(f.function().get())) {
      if (!side.is_bounded()) return {};
      const auto low = ir::as_const_int(ir::simplify(side.min)),
                 high = ir::as_const_int(ir::simplify(side.max));
      if (!low || !high || *high < *low || *high - *low > 4096) return {};
      region.mins.push_back(static_cast<int>(*low));
      region.extents.push_back(static_cast<int>(*high - *low + 1));
    }
    if (region.dimensions() != f.dimensions()) return {};
    return region;
  }

  // ---- differences ----

  // The first column of a Richardson tableau for slopes at h, h/2, h/4, whose errors go with
  // h^order, h^(order+grow) ...
  static double extrapolated(double a, double b, double c, double first, double second) {
    const double ab = (first * b - a) / (first - 1), bc = (first * c - b) / (first - 1);
    return (second * bc - ab) / (second - 1);
  }

  // Partials of float16 operations have its digits, in double too.
  bool has_float16() const {
    for (const ir::FuncPtr& f : ir::topological_order({p_.output().function()})) {
      bool found = false;
      for (int s = 0; s < f->stage_count(); ++s) {
        ir::for_each_expr(f->stage(s), [&](const Expr& root) {
          ir::walk(root, [&](const Expr& e) {
            return !(found |= e.type().is_float() && e.type().bits() == 16);
          });
        });
      }
      if (found) return true;
    }
    return false;
  }

  // False: it cannot be told here.
  bool compare_with_differences() {
    double up[3], down[3], central[3], right[3], left[3];
    for (int i = 0; i < 3; ++i) {
      const double h = step / (1 << i);
      up[i] = primal_at(h);
      down[i] = primal_at(-h);
      central[i] = (up[i] - down[i]) / (2 * h);
      right[i] = (up[i] - at_rest_) / h;
      left[i] = (at_rest_ - down[i]) / h;
    }
    const double slope = extrapolated(central[0], central[1], central[2], 4, 16),
                 coarse = (4 * central[1] - central[0]) / 3,
                 one_sided = extrapolated(right[0], right[1], right[2], 2, 4) -
                             extrapolated(left[0], left[1], left[2], 2, 4);
    const double scale = reverse_.magnitude + std::abs(slope) + 1e-3;
    const double doubt = (has_float16() ? 4e-3 : 1e-6) * scale + 10 * std::abs(slope - coarse) +
                         3 * std::abs(one_sided) + 1e-10 * largest_;
    if (!(doubt < 1e-2 * (std::abs(slope) + largest_))) return false;
    if (std::abs(slope - reverse_.sum) <= doubt) return true;
    decide(Judgement::Wrong,
           text("the gradient says ", reverse_.sum, " and differences ", slope, " +- ", doubt));
  }

  // ---- machine code ----

  void compare_machine_code() {
    for (const auto& [gradient, region] : gradients_) {
      try {
        compare_machine_code(gradient, region);
      } catch (const UserError& error) {
        // Machine code bounds what is read before it runs.
        if (primal_runs())
          decide(Judgement::Refused,
                 std::string("its gradient has no machine code: ") + error.what());
        return;
      }
    }
  }
  bool primal_runs() const {
    try {
      Func output = p_.output();
      std::vector<Buffer<>> results;
      for (const Type& t : output.types()) {
        results.emplace_back(t, p_.region.extents);
        results.back().set_min(p_.region.mins);
      }
      output.realize(Realization(results));
      return true;
    } catch (const UserError&) {
      return false;
    }
  }
  void compare_machine_code(const Func& gradient, const oracle::Region& region) {
    oracle::InterpreterOptions options;
    options.rounding = oracle::Rounding::Contraction;
    options.max_points = max_points;
    const oracle::Array expected =
        oracle::Interpreter(options).realize(gradient.function(), region)[0];
    Buffer<> first = realized(gradient, region), second = realized(gradient, region);
    const auto comparison = oracle::compare(expected, *first.raw_buffer(), 4);
    if (!comparison.agrees()) {
      decide(Judgement::Wrong,
             text("machine code of ", gradient.name(), ": ", comparison.mismatches,
                  " differ, first ", comparison.first_mismatch));
    }
    if (std::memcmp(first.data(), second.data(), first.size_in_bytes()) != 0) {
      decide(Judgement::Wrong,
             "machine code of " + gradient.name() + ": other bits in a second run");
    }
  }
  static Buffer<> realized(Func gradient, const oracle::Region& region) {
    Buffer<> result(gradient.types()[0], region.extents);
    result.set_min(region.mins);
    gradient.realize(result);
    return result;
  }

  const AdversaryProgram& p_;
  Weights weights_;
  const bool machine_code_;
  std::vector<Buffer<float>> w_, v_;  // weights of the output; directions of the images
  float v_scale_ = 1;
  double at_rest_ = 0, largest_ = 0;
  std::optional<Derivative> derivative_;
  std::vector<std::pair<Func, oracle::Region>> gradients_;
  Product reverse_;
};

template <typename F>
Judged guard(const F& f) {
  try {
    return f();
  } catch (const Verdict& verdict) {
    return verdict.judged;
  } catch (const UserError& error) {
    // An error in something that the compiler wrote itself is not the author's.
    const bool of_synthesis = std::string(error.what()).find("_adj") != std::string::npos;
    return {of_synthesis ? Judgement::Broken : Judgement::Refused, error.what()};
  } catch (const Unsupported& error) {
    return {Judgement::Refused, error.what()};
  } catch (const std::exception& error) {
    return {Judgement::Broken, std::string(error.what()).substr(0, longest_detail)};
  }
}

}  // namespace

const char* name_of(Judgement judgement) {
  static const char* const names[] = {"is right",   "is at a kink", "is refused",
                                      "is illegal", "is wrong",     "breaks the compiler"};
  return names[static_cast<int>(judgement)];
}

Judged judge(const AdversaryProgram& program, uint64_t seed, bool machine_code) {
  return guard([&] {
    Judge(program, seed, machine_code).run();
    return Judged{};
  });
}

Judged judge(Choices& choices, bool machine_code) {
  std::optional<AdversaryProgram> program;
  Judged made = guard([&] {
    program.emplace(make_program(choices));
    return Judged{};
  });
  if (made.judgement == Judgement::Refused) made.judgement = Judgement::Illegal;
  return program ? judge(*program, 1, machine_code) : made;
}

}  // namespace retrograde::gradient
