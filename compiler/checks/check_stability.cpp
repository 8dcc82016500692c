#include "checks/check_stability.h"

#include <cmath>
#include <limits>
#include <random>

#include "autodiff/sweeps/regions.h"
#include "checks/arrays.h"
#include "checks/culprit.h"
#include "checks/widen.h"
#include "diagnostics/error.h"
#include "frontend/data/param.h"

namespace retrograde {

namespace {

using namespace checks;
using checks::Values;
using Limits = std::numeric_limits<float>;

// The largest, the smallest normal and the smallest number of a type. Inputs in double are limited to the range of
// float32, since nothing exists to compare larger values with.
struct Ends {
  double max, min, denormal;
};
Ends ends_of(Type type) {
  if (type == Float(16)) return {65504.0, std::ldexp(1.0, -14), std::ldexp(1.0, -24)};
  if (type == BFloat(16))
    return {std::ldexp(255.0, 120), std::ldexp(1.0, -126), std::ldexp(1.0, -133)};
  return {Limits::max(), Limits::min(), Limits::denorm_min()};
}
double magnitude(Extreme extreme, Type type) {
  const Ends ends = ends_of(type);
  switch (extreme) {
    case Extreme::Zeros:
      return 0;
    case Extreme::Denormals:
      return ends.denormal * 100;
    case Extreme::Huge:
      return ends.max / 4;
    case Extreme::Tiny:
      return ends.min * 2;
    case Extreme::Infinities:
      return std::numeric_limits<double>::infinity();
    case Extreme::NaNs:
      return std::numeric_limits<double>::quiet_NaN();
  }
  return 0;
}

// A Func or adjoint to compare with double. The version in double has the same definitions, so the two differ only by
// rounding.
struct Watched {
  std::string name;  // name of the primal Func
  bool is_adjoint;
  Func own;
  Shape shape;
};
using Arrays = std::vector<std::vector<Values>>;  // by watched Func, then by its values

class StabilityChecker {
 public:
  StabilityChecker(const Func& output, const std::vector<int>& sizes,
                   const StabilityOptions& options)
      : output_(output),
        asked_("check the stability of " + retrograde::quoted(output.name())),
        shape_(shape_of_output(output, options.mins, sizes, asked_, "check_stability")),
        options_(options),
        random_(options.seed) {
    amount_.set(0);
    seed_.set(0);
    watch();
    check_ranges();
  }
  ~StabilityChecker() { restore(); }

  StabilityReport run() {
    add_case("as bound");
    estimate(report_.cases.back());
    for (Extreme extreme : options_.extremes) {
      replace_some(extreme);
      add_case(to_string(extreme));
      restore();
    }
    if (!options_.ranges.empty()) {
      for (int s = 0; s < options_.samples; ++s) {
        draw([&](const InputRange& r) { return inside(r); });
        add_case("in the ranges");
        if (s == 0) estimate(report_.cases.back());
      }
      draw([&](const InputRange& r) { return random_() % 2 ? r.low : r.high; });
      add_case("at the ends of the ranges");
      restore();
    }
    return std::move(report_);
  }

 private:
  // ---- Funcs and adjoints ----

  Derivative adjoints() const {
    std::vector<Expr> ones;
    for (Type t : output_.types()) ones.push_back(cast(t.is_float() ? t : Float(32), 1.0f));
    Func seed("seed");
    seed(output_.args()) = Tuple(ones);
    return propagate_adjoints(output_, seed, region_of(shape_),
                              {.overwritten = Overwritten::Store});
  }

  void watch() {
    auto order = topological_order({output_.function()});
    widen(
        {output_
             .function()});  // throws for operations without a meaning in double before anything is bound
    autodiff::Regions regions(order, box_of(shape_));
    Derivative derivative = adjoints();
    std::vector<Watched> adjoints;
    for (const FuncPtr& f : order) {
      const Func primal(f);
      auto shape = shape_of(*f, regions);
      if (!shape) continue;
      watched_.push_back({f->name, false, primal, *shape});
      if (derivative.has(primal)) {
        adjoints.push_back({f->name, true, derivative.adjoint(primal), *shape});
      } else {
        report_.left_out.push_back({"adjoint of " + f->name, "there is none"});
      }
    }
    watched_.insert(watched_.end(), adjoints.rbegin(), adjoints.rend());
    for (const auto& p : parameters_of({output_.function()})) {
      if (!p->type.is_float()) continue;
      if (derivative.has(AdjointInput(p)))
        watched_.push_back({p->name, true, derivative.of(AdjointInput(p)), shape_of_bound(*p)});
    }
    widen_watched();
  }

  std::optional<Shape> shape_of(const FuncContents& f, const autodiff::Regions& regions) {
    auto leave_out = [&](const char* reason) {
      report_.left_out.push_back({f.name, reason});
      return std::nullopt;
    };
    bool any = false;
    for (Type t : f.types) any |= is_checkable(t);
    if (!any) return leave_out("none of its values is a float");
    auto shape = constant_shape(regions.of(&f));
    if (!shape || shape->extents.size() != f.args.size())
      return leave_out("its region is not known before it runs, or is too large");
    return shape;
  }

  void widen_watched() {
    std::vector<FuncPtr> all{output_.function()};
    for (const Watched& w : watched_) all.push_back(w.own.function());
    Widened widened = widen(all, {amount_, seed_});
    for (const Watched& w : watched_) {
      own_.add(w.own, w.shape);
      wide_.add(Func(widened.funcs.at(w.own.function().get())), w.shape);
    }
    for (const auto& p : parameters_of({output_.function()})) {
      if (p->type.is_float())
        inputs_.push_back(bind_wide(p, widened.parameters.at(p.get()), asked_));
    }
    for (const Input& input : inputs_) now_.push_back(input.values);
  }

  // ---- the inputs ----

  void check_ranges() {
    for (const InputRange& r : options_.ranges) {
      if (!(std::isfinite(r.low) && std::isfinite(r.high) && r.low <= r.high)) {
        user_error(asked_, "a range has two finite ends, the lower first",
                   text("there is one from ", r.low, " to ", r.high),
                   "Give the lower end first, and leave infinities to StabilityOptions::extremes");
      }
      bool found = false;
      for (const Input& input : inputs_) found |= input.own == r.input.symbol();
      if (!found) {
        user_error(asked_, "a range belongs to a floating input that the output depends on",
                   "there is one of something else", "Give an ImageParam, a Buffer or a Param");
      }
    }
  }
  void set(size_t i, const Values& values) {
    now_[i] = values;
    inputs_[i].set_own(values);
    inputs_[i].set_wide(values);
  }
  void restore() {
    for (size_t i = 0; i < inputs_.size(); ++i) set(i, inputs_[i].values);
  }
  void replace_some(Extreme extreme) {
    for (size_t k = 0; k < inputs_.size(); ++k) {
      Values values = inputs_[k].values;
      bool any = false;
      for (size_t i = 0; i < values.size(); ++i) {
        bool chosen = random_() % 4 == 0 || (i + 1 == values.size() && !any);
        if (!chosen) continue;
        any = true;
        values[i] = magnitude(extreme, inputs_[k].own->type) * (random_() % 2 ? 1 : -1);
      }
      set(k, values);
    }
  }
  template <class Pick>
  void draw(Pick pick) {
    for (const InputRange& range : options_.ranges) {
      for (size_t k = 0; k < inputs_.size(); ++k) {
        if (inputs_[k].own != range.input.symbol()) continue;
        Values values = inputs_[k].values;
        for (double& v : values) v = held_by(inputs_[k].own->type, pick(range));
        set(k, values);
      }
    }
  }
  double inside(const InputRange& range) {
    std::uniform_real_distribution<double> at(0, 1);
    const double t = at(random_);
    if (range.low > 0 && range.high > 1000 * range.low)
      return range.low * std::pow(range.high / range.low, t);
    return range.low + (range.high - range.low) * t;
  }

  // ---- errors ----

  // Starts a case, or continues the last one if it has the same name; all samples form one case.
  void add_case(const std::string& name) {
    const bool is_new = report_.cases.empty() || report_.cases.back().name != name;
    if (is_new) report_.cases.push_back({name, {}, {}, {}});
    StabilityReport::Case& to = report_.cases.back();
    const Arrays own = own_.realize(), wide = wide_.realize();
    for (size_t k = 0, n = 0; k < watched_.size(); ++k) {
      const Watched& w = watched_[k];
      for (size_t v = 0; v < own[k].size(); ++v) {
        if (own[k][v].empty()) continue;
        if (is_new) to.funcs.push_back({w.name, w.is_adjoint, static_cast<int>(v)});
        compare(to, to.funcs[n++], w, own[k][v], wide[k][v]);
      }
    }
  }

  void compare(StabilityReport::Case& to, StabilityReport::FuncResult& f, const Watched& w,
               const Values& own, const Values& wide) {
    const double size = largest(wide);
    for (size_t i = 0; i < own.size(); ++i) {
      const bool finite = std::isfinite(own[i]), finite_wide = std::isfinite(wide[i]);
      f.non_finite += !finite;
      f.lost += !finite && finite_wide;
      if (finite && finite_wide) worsen(f.worst_error, relative_error(own[i], wide[i], size));
      if (finite) continue;
      auto& first = finite_wide ? to.first_lost : to.first_non_finite;
      if (!first) first = place(w, f.value, i, own[i], wide[i]);
    }
  }

  static StabilityReport::Place place(const Watched& w, int value, size_t i, double own,
                                      double wide) {
    const auto at = place_of(i, w.shape);
    return {w.name, w.is_adjoint, value, at, own, wide, culprit(w.own, value, at)};
  }

  // ---- estimates: computed in double, whose own rounding is negligible ----

  void estimate(StabilityReport::Case& to) {
    const double eps = Limits::epsilon();
    const Arrays base = wide_.realize();
    std::uniform_real_distribution<double> rounding(-eps, eps);
    for (int n = 0; n < options_.perturbations; ++n) {
      for (size_t k = 0; k < inputs_.size(); ++k) {
        Values moved = now_[k];
        for (double& v : moved) v *= 1 + rounding(random_);
        inputs_[k].set_wide(moved);
      }
      grow(to, base, &StabilityReport::FuncResult::condition);
    }
    for (size_t k = 0; k < inputs_.size(); ++k) inputs_[k].set_wide(now_[k]);
    amount_.set(eps / 2);
    for (int n = 0; n < options_.perturbations; ++n) {
      seed_.set(n + 1);
      grow(to, base, &StabilityReport::FuncResult::rounding);
    }
    amount_.set(0);
  }

  void grow(StabilityReport::Case& to, const Arrays& base,
            double StabilityReport::FuncResult::*what) {
    const Arrays now = wide_.realize();
    size_t n = 0;
    for (size_t w = 0; w < now.size(); ++w) {
      for (size_t v = 0; v < now[w].size(); ++v) {
        if (now[w][v].empty()) continue;
        double& worst = to.funcs[n++].*what;
        const double size = largest(base[w][v]);
        for (size_t i = 0; i < now[w][v].size(); ++i) {
          if (!std::isfinite(base[w][v][i])) continue;
          worsen(worst, relative_error(now[w][v][i], base[w][v][i], size) / Limits::epsilon());
        }
      }
    }
  }

  const Func& output_;
  std::string asked_;
  Shape shape_;
  StabilityOptions options_;
  std::mt19937_64 random_;
  Param<double> amount_{"rounding_amount"};
  Param<int> seed_{"rounding_seed"};
  std::vector<Watched> watched_;
  Batch own_, wide_;  // the watched Funcs in their own precision and in double
  std::vector<Input> inputs_;
  std::vector<Values> now_;  // current values of the inputs
  StabilityReport report_;
};

}  // namespace

StabilityReport check_stability(const Func& output, const std::vector<int>& sizes,
                                const StabilityOptions& options) {
  return StabilityChecker(output, sizes, options).run();
}

}  // namespace retrograde
