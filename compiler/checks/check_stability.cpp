#include "checks/check_stability.h"

#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "autodiff/derivative.h"
#include "autodiff/regions.h"
#include "checks/arrays.h"
#include "checks/widen.h"
#include "diagnostics/error.h"

namespace retrograde {

namespace {

using namespace checks;
using Limits = std::numeric_limits<float>;

double magnitude(Extreme extreme) {
  switch (extreme) {
    case Extreme::Zeros:
      return 0;
    case Extreme::Denormals:
      return Limits::denorm_min() * 100.0;
    case Extreme::Huge:
      return Limits::max() / 4;
    case Extreme::Tiny:
      return Limits::min() * 2.0;
    case Extreme::Infinities:
      return std::numeric_limits<double>::infinity();
    case Extreme::NaNs:
      return std::numeric_limits<double>::quiet_NaN();
  }
  return 0;
}

// One array of the pipeline, in both precisions.
struct Watched {
  std::string name;
  bool is_adjoint;
  Func own, wide;
  Shape shape;
};

class Checker {
 public:
  Checker(const Func& output, const std::vector<int>& sizes, const StabilityOptions& options)
      : output_(output),
        shape_{std::vector<int>(sizes.size(), 0), sizes},
        options_(options),
        random_(options.seed),
        widened_(ir::widen({output.function()})) {
    const std::string asked = "check the stability of " + retrograde::quoted(output.name());
    if (static_cast<int>(sizes.size()) != output.dimensions()) {
      user_error(asked, "the output needs a size in each of its dimensions",
                 text("it has ", output.dimensions(), " dimensions and ", sizes.size(), " sizes"));
    }
    for (const auto& p : ir::parameters_of({output.function()})) {
      if (p->type.is_float())
        inputs_.push_back(bind_wide(p, widened_.parameters.at(p.get()), asked));
    }
    watch();
  }
  ~Checker() { restore(); }

  StabilityReport run() {
    report_.cases.push_back(compare("as bound"));
    estimate_condition(report_.cases.back());
    for (Extreme extreme : options_.extremes) {
      replace_some(extreme);
      report_.cases.push_back(compare(to_string(extreme)));
      restore();
    }
    return std::move(report_);
  }

 private:
  Derivative adjoints_of(const Func& f) const {
    Region bounds;
    for (int e : shape_.extents) bounds.push_back({0, e});
    std::vector<Expr> ones;
    for (Type t : f.types()) ones.push_back(cast(t.is_float() ? t : Float(32), 1.0f));
    Func seed("seed");
    seed(f.args()) = Tuple(ones);
    return propagate_adjoints(f, seed, bounds, {.overwritten = Overwritten::Store});
  }

  void watch() {
    auto order = ir::topological_order({output_.function()});
    ir::Box box;
    for (int e : shape_.extents) box.push_back({Expr(0), Expr(e - 1)});
    ir::Regions regions(order, box);
    Derivative own = adjoints_of(output_);
    Derivative wide = adjoints_of(Func(widened_.funcs.at(output_.function().get())));
    std::vector<Watched> adjoints;
    for (const ir::FuncPtr& f : order) {
      auto shape = constant_shape(regions.of(f.get()));
      if (!shape || shape->extents.size() != f->args.size() || f->types.size() != 1 ||
          !(f->types[0] == Float(32) || f->types[0] == Float(64)))
        continue;
      Func primal(f), wide_primal(widened_.funcs.at(f.get()));
      watched_.push_back({f->name, false, primal, wide_primal, *shape});
      Func a = own.adjoint(primal), b = wide.adjoint(wide_primal);
      if (a.defined() && b.defined()) adjoints.push_back({f->name, true, a, b, *shape});
    }
    watched_.insert(watched_.end(), adjoints.rbegin(), adjoints.rend());
    for (const Input& input : inputs_) {
      Func a = own.of(AdjointInput(input.own)), b = wide.of(AdjointInput(input.wide));
      if (a.defined() && b.defined())
        watched_.push_back({input.own->name, true, a, b, input.shape});
    }
  }

  void restore() {
    for (Input& input : inputs_) {
      input.set_own(input.values);
      input.set_wide(input.values);
    }
  }
  void replace_some(Extreme extreme) {
    for (Input& input : inputs_) {
      Values values = input.values;
      bool any = false;
      for (size_t i = 0; i < values.size(); ++i) {
        bool chosen = random_() % 4 == 0 || (i + 1 == values.size() && !any);
        if (!chosen) continue;
        any = true;
        values[i] = magnitude(extreme) * (random_() % 2 ? 1 : -1);
      }
      input.set_own(values);
      input.set_wide(values);
    }
  }

  StabilityReport::Case compare(const std::string& name) {
    StabilityReport::Case result{name, {}, {}, {}};
    for (const Watched& w : watched_) {
      StabilityReport::FuncResult f = compare(realize(w.own, w.shape), realize(w.wide, w.shape));
      f.name = w.name;
      f.is_adjoint = w.is_adjoint;
      std::string where = w.is_adjoint ? "adjoint of " + w.name : w.name;
      if (f.lost > 0 && result.first_lost.empty()) result.first_lost = where;
      if (f.non_finite > f.lost && result.first_non_finite.empty()) result.first_non_finite = where;
      result.funcs.push_back(f);
    }
    return result;
  }

  static StabilityReport::FuncResult compare(const Values& own, const Values& wide) {
    StabilityReport::FuncResult result;
    const double size = largest(wide);
    for (size_t i = 0; i < own.size(); ++i) {
      bool finite = std::isfinite(own[i]), finite_wide = std::isfinite(wide[i]);
      result.non_finite += !finite;
      result.lost += !finite && finite_wide;
      if (finite && finite_wide) worsen(result.worst_error, relative_error(own[i], wide[i], size));
    }
    return result;
  }

  // In double, so that what is seen is the function and not its rounding: inputs move by random
  // relative amounts of the size of a float32 rounding.
  void estimate_condition(StabilityReport::Case& to) {
    const double eps = Limits::epsilon();
    std::vector<Values> base;
    for (const Watched& w : watched_) base.push_back(realize(w.wide, w.shape));
    std::uniform_real_distribution<double> rounding(-eps, eps);
    for (int n = 0; n < options_.perturbations; ++n) {
      for (Input& input : inputs_) {
        Values moved = input.values;
        for (double& v : moved) v *= 1 + rounding(random_);
        input.set_wide(moved);
      }
      for (size_t i = 0; i < watched_.size(); ++i) {
        Values now = realize(watched_[i].wide, watched_[i].shape);
        double size = largest(base[i]);
        for (size_t k = 0; k < now.size(); ++k)
          worsen(to.funcs[i].condition, relative_error(now[k], base[i][k], size) / eps);
      }
    }
    restore();
  }

  const Func& output_;
  Shape shape_;
  StabilityOptions options_;
  std::mt19937_64 random_;
  ir::Widened widened_;
  std::vector<Input> inputs_;
  std::vector<Watched> watched_;
  StabilityReport report_;
};

// JSON has no NaN and no infinity.
nlohmann::json number(double v) {
  return std::isfinite(v) ? nlohmann::json(v) : nlohmann::json(std::isnan(v) ? "nan" : "inf");
}

}  // namespace

const char* to_string(Extreme extreme) {
  switch (extreme) {
    case Extreme::Zeros:
      return "zeros";
    case Extreme::Denormals:
      return "denormals";
    case Extreme::Huge:
      return "huge";
    case Extreme::Tiny:
      return "tiny";
    case Extreme::Infinities:
      return "infinities";
    case Extreme::NaNs:
      return "NaNs";
  }
  return "";
}

std::string StabilityReport::to_json() const {
  nlohmann::json result = nlohmann::json::array();
  for (const Case& c : cases) {
    nlohmann::json funcs = nlohmann::json::array();
    for (const FuncResult& f : c.funcs)
      funcs.push_back({{"name", f.name},
                       {"adjoint", f.is_adjoint},
                       {"worst_error", number(f.worst_error)},
                       {"condition", number(f.condition)},
                       {"non_finite", f.non_finite},
                       {"lost", f.lost}});
    result.push_back({{"inputs", c.name},
                      {"first_lost", c.first_lost},
                      {"first_non_finite", c.first_non_finite},
                      {"funcs", funcs}});
  }
  return result.dump(2);
}

StabilityReport check_stability(const Func& output, const std::vector<int>& sizes,
                                const StabilityOptions& options) {
  return Checker(output, sizes, options).run();
}

}  // namespace retrograde
