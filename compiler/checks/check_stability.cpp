#include "checks/check_stability.h"

#include <cmath>
#include <limits>

#include "autodiff/sweeps/regions.h"
#include "checks/arrays.h"
#include "checks/culprit.h"
#include "checks/stability_inputs.h"
#include "checks/widen.h"
#include "diagnostics/error.h"
#include "frontend/data/param.h"

namespace retrograde {

namespace {

using namespace checks;
using checks::Values;
using Limits = std::numeric_limits<float>;

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
        inputs_(options) {
    amount_.set(0);
    seed_.set(0);
    watch();
    inputs_.check_ranges(asked_);
  }
  ~StabilityChecker() { inputs_.restore(); }

  StabilityReport run() {
    add_case("as bound");
    estimate(report_.cases.back());
    for (Extreme extreme : options_.extremes) {
      inputs_.replace_some(extreme);
      add_case(to_string(extreme));
      inputs_.restore();
    }
    if (!options_.ranges.empty()) {
      for (int s = 0; s < options_.samples; ++s) {
        inputs_.draw_in_ranges();
        add_case("in the ranges");
        if (s == 0) estimate(report_.cases.back());
      }
      inputs_.draw_ends_of_ranges();
      add_case("at the ends of the ranges");
      inputs_.restore();
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
    for (const auto& p : floating_inputs(output_)) {
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
    for (const auto& p : floating_inputs(output_))
      inputs_.add(bind_wide(p, widened.parameters.at(p.get()), asked_));
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
    const Arrays base = wide_.realize();
    for (int n = 0; n < options_.perturbations; ++n) {
      inputs_.round_at_random();
      grow(to, base, &StabilityReport::FuncResult::condition);
    }
    inputs_.undo_rounding();
    amount_.set(Limits::epsilon() / 2);
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
  StabilityInputs inputs_;
  Param<double> amount_{"rounding_amount"};
  Param<int> seed_{"rounding_seed"};
  std::vector<Watched> watched_;
  Batch own_, wide_;  // the watched Funcs in their own precision and in double
  StabilityReport report_;
};

}  // namespace

StabilityReport check_stability(const Func& output, const std::vector<int>& sizes,
                                const StabilityOptions& options) {
  return StabilityChecker(output, sizes, options).run();
}

}  // namespace retrograde
