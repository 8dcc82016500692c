#include "gradient/adversary/check.h"

#include <cmath>
#include <limits>

#include "autodiff/sweeps/regions.h"
#include "diagnostics/error.h"
#include "gradient/adversary/probe.h"
#include "ir/build.h"
#include "simplify/simplify.h"
#include "testing/check_program.h"

namespace retrograde::gradient {

namespace {

constexpr size_t longest_detail = 600;  // internal errors carry whole programs

class Judge {
 public:
  Judge(const AdversaryProgram& program, const AdversaryProgram* twin, uint64_t seed,
        bool machine_code, std::map<std::string, uint64_t>& counts)
      : p_(program),
        twin_(twin),
        s_{program, Weights(seed)},
        machine_code_(machine_code),
        counts_(counts) {}

  void run() {
    seed_outputs();
    v_.emplace(p_, s_.weights, "v");
    at_rest_ = primal("it");
    if (!std::isfinite(at_rest_)) decide(Judgement::Illegal, "its value is not finite");
    differentiate();
    compare(forward(v_->directions()), reverse_, "along the inputs");
    if (p_.checks.one_input) compare_one_input();
    if (!p_.has_rule && s_.outputs.size() == 1) {
      if (!p_.only_inputs) compare_along_func();
      if (p_.checks.several) compare_with_two_outputs();
    }
    const bool is_smooth = compare_with_differences();
    if (p_.checks.order > 1 && !s_.is_late()) {
      compare_higher(s_, *v_, *derivative_);
      ++counts_["with higher derivatives"];
    }
    if (p_.checks.dense && !s_.is_late()) {
      compare_dense(s_);
      ++counts_["with dense matrices"];
    }
    if (machine_code_) {
      ++counts_["as machine code"];
      const int scheduled = compare_machine_code(s_, *derivative_, gradients_, twin_);
      if (scheduled < 0) {
        ++counts_["that do not run as machine code"];
      } else {
        counts_["gradients scheduled"] += static_cast<uint64_t>(scheduled);
      }
    }
    if (!is_smooth) decide(Judgement::Kink, "");
  }

 private:
  // ---- the primal ----

  void seed_outputs() {
    for (size_t i = 0; i < p_.outputs.size(); ++i) {
      SeededOutput each{p_.outputs[i], p_.runs.front()[i], {}, {}};
      for (int k = 0; k < each.output.outputs(); ++k)
        each.w.push_back(s_.weights.over(each.region, text("w", s_.outputs.size() * 10 + k)));
      each.seed = p_.checks.wild ? reading_inside(each.w, each.region, std::nanf(""))
                                 : reading(each.w, "w");
      s_.outputs.push_back(each);
    }
  }
  // sum w * output in double. A program that cannot be evaluated is not legal.
  double primal(const char* what) {
    try {
      const Product sum = s_.total([](const SeededOutput& each) {
        return weighted(interpret(each.output, each.region), each.region, each.w);
      });
      s_.largest = std::max(s_.largest, sum.magnitude);
      return sum.sum;
    } catch (const InternalError&) {
      throw;
    } catch (const std::exception& error) {
      decide(Judgement::Illegal, std::string(what) + " cannot be evaluated: " + error.what());
    }
  }

  // ---- the derivative ----

  void differentiate() {
    derivative_.emplace(propagate_adjoints(s_.adjoints(), options()));
    reverse_ = product_along(*v_);
    const std::vector<AdjointInput> inputs = v_->inputs();
    for (size_t i = 0; i < inputs.size(); ++i) {
      const Func gradient = derivative_->of(inputs[i]);
      // Undefined: the output does not read the input.
      if (gradient.defined()) check_around(gradient, v_->region(i));
      gradients_.push_back({gradient, v_->region(i)});
    }
  }

  AdjointOptions options() const {
    AdjointOptions result = p_.options;
    if (p_.only_inputs) result.wrt = s_.options().wrt;
    return result;
  }

  // The gradient must be 0 in a ring around the region.
  void check_around(const Func& gradient, const oracle::Region& region) {
    oracle::Region around = region;
    for (size_t d = 0; d < region.mins.size(); ++d) --around.mins[d], around.extents[d] += 2;
    const oracle::Array found = evaluate(gradient, around)[0];
    around.for_each([&](const std::vector<int>& at) {
      bool inside = true;
      for (size_t d = 0; d < at.size(); ++d)
        inside &= at[d] >= region.mins[d] && at[d] < region.mins[d] + region.extents[d];
      if (!inside && as_double(found.at(at)) != 0)
        decide(Judgement::Wrong, gradient.name() + " is not 0 outside of the input");
    });
  }

  // The gradient by one input, requested alone, must be that of all gradients together.
  void compare_one_input() {
    const std::vector<AdjointInput> inputs = v_->inputs();
    const auto i = static_cast<size_t>(s_.weights.below(static_cast<int>(inputs.size())));
    AdjointOptions alone = options();
    alone.wrt = {inputs[i]};
    const Func gradient = propagate_adjoints(s_.adjoints(), alone).of(inputs[i]);
    const auto& [with_others, region] = gradients_[i];
    if (!gradient.defined() || !with_others.defined()) return;
    const oracle::Array a = evaluate(gradient, region)[0], b = evaluate(with_others, region)[0];
    for (size_t k = 0; k < a.values.size(); ++k) {
      const double found = as_double(a.values[k]), expected = as_double(b.values[k]);
      if (!std::isfinite(found) && !std::isfinite(expected)) continue;
      if (std::abs(found - expected) <= 1e-11 * (std::abs(expected) + reverse_.magnitude + 1))
        continue;
      decide(Judgement::Wrong, text(gradient.name(), " is ", found, " if requested alone, and ",
                                    expected, " with others"));
    }
    ++counts_["with one gradient alone"];
  }

  // ---- forward mode ----

  double forward(const std::vector<Direction>& directions) {
    double sum = 0;
    for (const SeededOutput& each : s_.outputs)
      sum += forward(directions, each.output, each.region, each.w);
    return sum;
  }
  static double forward(const std::vector<Direction>& directions, const Func& output,
                        const oracle::Region& region, const std::vector<Buffer<float>>& weights) {
    const Func t = propagate_tangents(output, directions)(output);
    return t.defined() ? weighted(evaluate(t, region), region, weights).sum : 0;
  }
  void compare(double jv, const Product& jtw, const std::string& where) {
    const double slack = 1e-11 * (jtw.magnitude + std::abs(jv) + 1 + s_.largest);
    if (std::abs(jv - jtw.sum) <= slack) return;
    if (!std::isfinite(jv) && !jtw.is_finite()) return;
    decide(Judgement::Wrong,
           text("forward and reverse mode differ ", where, ": ", jv, " and ", jtw.sum));
  }

  // The first or the last Func before the output, the region read of it, and weights of its values.
  struct Inner {
    Func func;
    oracle::Region region;
    std::vector<Buffer<float>> weights;
    Func reader() const { return reading_inside(weights, region, 0.0f); }
  };
  std::optional<Inner> inner_func() {
    if (p_.funcs.size() < 2) return {};
    const std::vector<graph::FuncPtr> order = graph::topological_order({p_.output().function()});
    const Func f = p_.funcs[static_cast<size_t>(s_.weights.next() > 0) * (p_.funcs.size() - 2)];
    if (std::find(order.begin(), order.end(), f.function()) == order.end()) return {};
    for (const Type& t : f.types()) {
      if (!t.is_float()) return {};
    }
    const std::optional<oracle::Region> region = region_of(f, order);
    if (!region || region->points() > 4096) return {};
    std::vector<Buffer<float>> weights;
    for (int k = 0; k < f.outputs(); ++k)
      weights.push_back(s_.weights.over(*region, "along" + std::to_string(k)));
    return Inner{f, *region, weights};
  }

  // Compares the adjoint of a Func with the tangent of the stages after it.
  void compare_along_func() {
    const std::optional<Inner> inner = inner_func();
    const Func adjoint = inner ? derivative_->adjoint(inner->func) : Func();
    if (!adjoint.defined()) return;
    const Product product =
        weighted(evaluate(adjoint, inner->region), inner->region, inner->weights);
    compare(forward({{inner->func, inner->reader()}}), product, "along " + inner->func.name());
  }
  // Compares the gradient of the output and of a Func before it, in one pass, with both tangents.
  void compare_with_two_outputs() {
    const std::optional<Inner> inner = inner_func();
    if (!inner || inner->region.points() == 0) return;
    Region bounds;
    for (int d = 0; d < inner->func.dimensions(); ++d)
      bounds.push_back({inner->region.mins[d], inner->region.extents[d]});
    const Derivative both = propagate_adjoints(
        {s_.adjoints().front(), {inner->func, inner->reader(), bounds}}, options());
    const Product product = v_->along([&](const AdjointInput& x) { return both.of(x); });
    const std::vector<Direction> directions = v_->directions();
    compare(forward(directions) + forward(directions, inner->func, inner->region, inner->weights),
            product, "with " + inner->func.name() + " as another output");
    ++counts_["with two outputs"];
  }
  // The region of f that is read; none if it has no constant bounds or is never read.
  std::optional<oracle::Region> region_of(const Func& f,
                                          const std::vector<graph::FuncPtr>& order) const {
    analysis::Box box;
    for (const Range& r : s_.first().bounds())
      box.push_back({r.min, simplification::simplify(r.min + r.extent - 1)});
    const autodiff::Regions regions(order, box);
    oracle::Region region;
    for (const ir::Interval& side : regions.of(f.function().get())) {
      if (!side.is_bounded()) return {};
      const auto low = ir::as_const_int(simplification::simplify(side.min)),
                 high = ir::as_const_int(simplification::simplify(side.max));
      if (!low || !high || *high < *low || *high - *low > 4096) return {};
      region.mins.push_back(static_cast<int>(*low));
      region.extents.push_back(static_cast<int>(*high - *low + 1));
    }
    if (region.dimensions() != f.dimensions()) return {};
    return region;
  }

  // ---- differences ----

  // Returns false if differences cannot decide. A wrong gradient is wrong along any direction, and slopes are additive,
  // while kinks that cancel along one direction do not along another. At the median of three equal elements, both
  // one-sided slopes agree along every direction, but slopes are not additive.
  bool compare_with_differences() {
    const Differences first = differences_along(*v_, reverse_);
    if (first.is_right() || !first.slope.is_smooth) return first.slope.is_smooth;
    if (turns_within_a_step(p_.outputs, reverse_.magnitude)) return false;
    for (int i = 0; i < 6; ++i) {
      const Motion another(p_, s_.weights, "v_again");
      const Differences second = differences_along(another, product_along(another));
      if (second.is_right() || !second.slope.is_smooth) return false;
      const Motion both = *v_ + another;
      const Slope sum = differences_along(both, product_along(both)).slope;
      const double doubt = sum.doubt + first.slope.doubt + second.slope.doubt;
      const double gap = std::abs(sum.value - first.slope.value - second.slope.value);
      if (!sum.is_smooth || gap > doubt) return false;
    }
    decide(Judgement::Wrong, text("the gradient says ", first.gradient, " and differences ",
                                  first.slope.value, " +- ", first.slope.doubt));
  }
  struct Differences {
    double gradient;
    Slope slope;
    bool is_right() const { return std::abs(slope.value - gradient) <= slope.doubt; }
  };
  Product product_along(const Motion& v) const {
    return v.along([&](const AdjointInput& x) { return derivative_->of(x); });
  }
  Differences differences_along(const Motion& v, const Product& gradient) {
    const auto moved = [&](double by) {
      v.move(by);
      const double result = primal("a neighbour of it");
      v.move(-by);
      return result;
    };
    return {gradient.sum,
            slope_of(moved, at_rest_, gradient.magnitude, s_.largest, precision_of(p_.outputs))};
  }

  const AdversaryProgram& p_;
  const AdversaryProgram* twin_;
  Subject s_;
  const bool machine_code_;
  std::map<std::string, uint64_t>& counts_;
  std::optional<Motion> v_;
  double at_rest_ = 0;
  std::optional<Derivative> derivative_;
  Gradients gradients_;
  Product reverse_;
};

template <typename F>
Judged guard(const F& f) {
  try {
    return f();
  } catch (const Verdict& verdict) {
    return verdict.judged;
  } catch (const UserError& error) {
    // An error in code that the compiler generated is not the author's fault.
    const bool of_synthesis = std::string(error.what()).find("_adj") != std::string::npos;
    const bool is_compilers = of_synthesis || fuzz::is_access_outside(error);
    return {is_compilers ? Judgement::Broken : Judgement::Refused, error.what()};
  } catch (const Unsupported& error) {
    return {Judgement::Refused, error.what()};
  } catch (const std::exception& error) {
    return {Judgement::Broken, std::string(error.what()).substr(0, longest_detail)};
  }
}

// A program that is refused while it is made is illegal.
Judged guard_making(const std::function<void()>& make) {
  Judged made = guard([&] {
    make();
    return Judged{};
  });
  if (made.judgement == Judgement::Refused) made.judgement = Judgement::Illegal;
  return made;
}

}  // namespace

Judged judge(const AdversaryProgram& program, uint64_t seed, bool machine_code,
             const AdversaryProgram* twin) {
  std::map<std::string, uint64_t> counts;
  for (const std::string& content : program.contents) counts[content] = 1;
  Judged result = guard([&] {
    Judge(program, twin, seed, machine_code, counts).run();
    return Judged{};
  });
  result.counts = counts;
  return result;
}

Judged judge(Choices& choices, bool machine_code) {
  std::optional<AdversaryProgram> program, twin;
  Judged made = guard_making([&] {
    program.emplace(make_adversary(choices));
    Choices again(choices.taken());
    if (machine_code && program->has_stage) twin.emplace(make_adversary(again, true));
  });
  if (made.judgement != Judgement::Right) return made;
  return judge(*program, 1, machine_code, twin ? &*twin : nullptr);
}

Judged judge_workload(Choices& choices, bool machine_code, fuzz::Workload kind) {
  std::optional<AdversaryProgram> program;
  const Judged made =
      guard_making([&] { program.emplace(make_workload_adversary(choices, kind)); });
  if (made.judgement != Judgement::Right) return made;
  return judge(*program, 1, machine_code);
}

}  // namespace retrograde::gradient
