#include "autodiff/sums/phases.h"

#include <algorithm>
#include <compare>
#include <map>
#include <numeric>
#include <optional>

#include "analysis/linear.h"
#include "analysis/periods.h"
#include "autoschedule/machine/reference.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// Elements of a full vector; vectors of at least half of them along the phase are worth a dense read.
constexpr int64_t lanes = planning::schedule_lanes, least_lanes = lanes / 2;

// A comparison without a common factor, of which each phase has its share: 2 * q + p <= 2 * rho + 63, with p < 2, is
// q <= rho + 31. Borders then have the form of those without a stride (zero_borders.h).
Expr reduced(const Expr& comparison, const std::string& phase,
             const simplification::BoundsMap& bounds) {
  const std::optional<Sum> form = nonnegative_where(comparison);
  if (!form || !form->valid) return comparison;
  int64_t factor = 0;
  for (const Term& term : form->terms) {
    const auto* variable = term.atom.as<Variable>();
    if (!variable || variable->name != phase) factor = std::gcd(factor, term.factor);
  }
  if (factor <= 1) return comparison;
  const DividedSum parts = divide_terms(*form, factor);
  const Expr whole = to_expr(parts.quotient), rest = to_expr(parts.remainder);
  if (!whole.defined() || !rest.defined()) return comparison;
  const Expr share = simplify(rest / make_const(Int(32), factor), bounds);
  const bool is_in_lanes = !as_const_int(share) && factor >= lanes;  // they would divide
  return is_in_lanes ? comparison : simplify(whole + share >= 0, bounds);
}

// Index expressions and conditions in terms of quotient and phase, without the divisions that they decide.
Expr in_phases(const Expr& e, const Substitution& place, const std::string& phase,
               const simplification::BoundsMap& bounds) {
  if (!e.defined()) return e;
  return rewrite(
      substitute(e, place), [&](const Expr& node, const std::function<Expr(const Expr&)>& recurse) {
        const bool joins = node.as<And>() || node.as<Or>() || node.as<Not>();
        if (node.type().is_bool() && !joins) return reduced(simplify(node, bounds), phase, bounds);
        return node.type() == Int(32) ? simplify(node, bounds) : map_children(node, recurse);
      });
}

bool sums_at_each_element(const Gather& g) {
  return g.rdom && !g.scatters && g.is_everywhere() && !g.lhs.empty();
}

// The period of a contribution; 1 if it stays as it is.
int64_t period_of(const Contribution& c, const AdjointTarget& target) {
  if (!sums_at_each_element(c.gather) || target.region.size() != target.args.size()) return 1;
  const std::string& row = target.args[0];
  const int64_t of_terms = period_in(c.adjoint, row);
  const Expr& predicate = c.gather.predicate;
  const int64_t of_predicate = predicate.defined() ? period_in(predicate, row) : 1;
  const int64_t period = of_terms * of_predicate == 0 ? 1 : std::lcm(of_terms, of_predicate);
  if (period <= 1 || period > longest_period) return 1;
  const auto extent = constant_extent(target.region[0].range());
  if (!extent) return period;
  const bool fills_lanes = *extent >= period * least_lanes || period >= lanes;
  return *extent > period && fills_lanes ? period : 1;
}

// Whether vectors run along the phases: these fill one, or reads are dense along them only.
bool runs_along_phases(const Contribution& c, int64_t period, const std::string& quotient,
                       const std::string& phase) {
  if (period >= lanes) return true;
  bool along_quotient = false, along_phase = false;
  walk(c.adjoint, [&](const Call& call) {
    if (call.call_type == CallType::Operator || call.args.empty()) return;
    along_quotient |= uses_variable(call.args[0], quotient);
    along_phase |= uses_variable(call.args[0], phase);
  });
  return period >= least_lanes && along_phase && !along_quotient;
}

std::string fresh(const std::vector<std::string>& taken, std::string name) {
  while (std::ranges::find(taken, name) != taken.end()) name += "_";
  return name;
}

// y = period * quotient + phase - offset
struct Phases {
  int64_t period = 1, offset = 0;
  auto operator<=>(const Phases&) const = default;
};

// The constant that a division adds to the variable, so that no phase wraps around: 1 in (v + r + 1) / 2.
std::optional<int64_t> offset_in(const Expr& e, const std::string& variable) {
  std::optional<int64_t> offset;
  walk(e, [&](const Expr& node) {
    const bool divides = node.kind() == Kind::Div || node.kind() == Kind::Mod;
    if (offset || !divides || node.type() != Int(32)) return !offset;
    const Sum operand = linear_form(node.as<Binary>()->a);
    const int64_t factor = operand.factor_of(variable);
    if (operand.valid && std::abs(factor) == 1) offset = factor * operand.constant;
    return !offset;
  });
  return offset;
}

Phases phases_of(const Contribution& c, const AdjointTarget& target) {
  const int64_t period = period_of(c, target);
  if (period <= 1) return {};
  const int64_t offset = offset_in(c.adjoint, target.args[0]).value_or(0) % period;
  return {period, offset < 0 ? offset + period : offset};
}

class PhaseSplitter {
 public:
  PhaseSplitter(const AdjointTarget& target, const Phases& phases)
      : original_(target),
        period_(make_const(Int(32), phases.period)),
        offset_(make_const(Int(32), phases.offset)),
        quotient_(fresh(target.args, target.args[0] + "_block")),
        phase_(fresh(target.args, target.args[0] + "_phase")) {
    sum_.period = phases.period;
    sum_.target = target;
    place_ = {{target.args[0], variable(quotient_) * period_ + variable(phase_) - offset_}};
    bounds_[phase_] = {make_zero(Int(32)), period_ - 1};
  }

  PhasedSum split(const std::vector<Contribution>& contributions) {
    for (const Contribution& c : contributions) {
      sum_.contributions.push_back({c.component, c.gather, split(c.adjoint)});
      Expr& predicate = sum_.contributions.back().gather.predicate;
      if (predicate.defined()) predicate = simplify(split(predicate), bounds_);
      if (predicate.defined() && is_const_true(predicate)) predicate = Expr();
    }
    const auto is_along = [&](const Contribution& c) {
      return runs_along_phases(c, sum_.period, quotient_, phase_);
    };
    renumber(std::ranges::any_of(sum_.contributions, is_along));
    return std::move(sum_);
  }

 private:
  Expr split(const Expr& e) const { return in_phases(e, place_, phase_, bounds_); }

  void renumber(bool phase_first) {
    const Expr element = variable(original_.args[0]) + offset_;
    std::vector<std::string> args{quotient_, phase_};
    std::vector<Expr> place{element / period_, element % period_};
    std::vector<LoopVariable> region = regions();
    if (phase_first) {
      std::swap(args[0], args[1]);
      std::swap(place[0], place[1]);
      std::swap(region[0], region[1]);
    }
    for (size_t d = 1; d < original_.args.size(); ++d) {
      args.push_back(original_.args[d]);
      place.push_back(variable(original_.args[d]));
      region.push_back(original_.region[d]);
    }
    sum_.target.args = args;
    sum_.target.region = region;
    sum_.place = place;
    for (Contribution& c : sum_.contributions) {
      c.gather.lhs = variables_of(args);
      c.gather.pure.assign(args.size(), true);
      for (auto& [name, e] : c.gather.iteration) e = split(e);
    }
  }

  // The regions of quotient and phase.
  std::vector<LoopVariable> regions() const {
    const LoopVariable& all = original_.region[0];
    const auto block = [&](const Expr& end) {
      return end.defined() ? simplify((end + offset_) / period_) : end;
    };
    return {{quotient_, block(all.min), block(all.max), all.is_reduction},
            {phase_, make_zero(Int(32)), period_ - 1, all.is_reduction}};
  }

  const AdjointTarget& original_;
  const Expr period_, offset_;
  const std::string quotient_, phase_;
  Substitution place_;
  simplification::BoundsMap bounds_;
  PhasedSum sum_;
};

}  // namespace

std::vector<PhasedSum> take_phased_sums(const AdjointTarget& target,
                                        std::vector<Contribution>& contributions) {
  std::map<Phases, std::vector<Contribution>> phased;
  std::vector<Contribution> others;
  for (Contribution& c : contributions) {
    const Phases phases = phases_of(c, target);
    (phases.period > 1 ? phased[phases] : others).push_back(c);
  }
  std::vector<PhasedSum> result;
  for (const auto& [phases, sums] : phased)
    result.push_back(PhaseSplitter(target, phases).split(sums));
  if (!result.empty()) contributions = std::move(others);
  return result;
}

}  // namespace retrograde::autodiff
