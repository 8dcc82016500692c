#include "autodiff/sums/accumulation.h"

#include <algorithm>
#include <map>
#include <set>

#include "autodiff/borders/border_conditions.h"
#include "autodiff/borders/join_borders.h"
#include "autodiff/borders/zero_borders.h"
#include "autodiff/sums/blocked_sums.h"
#include "autodiff/sums/chosen_terms.h"
#include "autodiff/sums/constant_places.h"
#include "autodiff/sums/gather_places.h"
#include "autodiff/sums/generated_definitions.h"
#include "autodiff/sums/phases.h"
#include "autodiff/sums/privatisation.h"
#include "autodiff/sums/running_sums.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// Gathers over one domain that differ only in their borders share an update, in which each adds 0 beyond its border.
// The shared loop then reads common operands once. The number of gathers is limited because one body holds all their
// reads.
constexpr size_t most_borders = 4;
void share_domains(std::vector<Contribution>& contributions) {
  const auto domain_of = [](Gather g) {
    g.predicate = Expr();
    return shape_of(g);
  };
  std::map<std::string, std::set<std::string>> borders;  // by domain
  for (const Contribution& c : contributions) {
    if (has_borders(c.gather)) borders[domain_of(c.gather)].insert(shape_of(c.gather));
  }
  for (Contribution& c : contributions) {
    if (!has_borders(c.gather)) continue;
    const size_t different = borders[domain_of(c.gather)].size();
    if (different < 2 || different > most_borders) continue;
    c.adjoint = masked(c.gather.predicate, c.adjoint);
    c.gather.predicate = Expr();
  }
}

// Whether some elements between those that it reaches stay 0.
bool leaves_zeros(const Contribution& c) {
  return !c.gather.is_everywhere() ||
         (c.gather.predicate.defined() && !is_range_condition(c.gather.predicate));
}

class Builder {
 public:
  Builder(const AdjointTarget& target, const std::string& name)
      : target_(target),
        name_(claim_name(name)),
        types_(target.types),
        args_(variables_of(target.args)) {}

  AdjointFunc build(const std::vector<Contribution>& contributions,
                    const std::vector<Expr>& initial) {
    const std::vector<Iterations> updates = updates_of(contributions, types_.size());
    const bool goes_on_wide =
        !contributions.empty() &&
        std::ranges::any_of(initial, [&](const Expr& e) { return is_wider(e); });
    if (goes_on_wide ||
        std::ranges::any_of(updates, [&](const Iterations& u) { return is_long(u); }))
      widen();
    result_.func = new_func(is_wide_ ? claim_name(name_ + "_sum") : name_,
                            is_wide_ ? Role::Accumulator : Role::Adjoint);
    define_pointwise(contributions, initial);
    note_traits(result_.func, initial);
    estimate(result_.func);
    for (const Contribution& c : contributions) {
      note_traits(result_.func, {c.adjoint});
      if (leaves_zeros(c)) result_.func->made->traits.masked = true;
    }
    for (const Iterations& update : updates) {
      auto parts = plan_parts(update, target_, types_);
      parts ? add_privatised(with_rows_innermost(update, *parts), *parts) : add_update(update);
    }
    if (is_wide_) round_once();
    return std::move(result_);
  }

 private:
  // A running sum that starts in double continues in double.
  bool is_wider(const Expr& value) const {
    return value.defined() &&
           std::ranges::all_of(types_, [&](Type t) { return value.type().bits() > t.bits(); });
  }
  bool is_long(const Iterations& update) const {
    return sums_many_terms(update.over, target_, types_);
  }
  FuncPtr new_func(const std::string& name, Role role = Role::Adjoint) const {
    FuncPtr f = make_func(role);
    f->made->of = target_.name;
    f->name = name;
    return f;
  }

  // Sets estimates of the extents of the target's dimensions where they are known, as users do.
  void estimate(const FuncPtr& f) const {
    if (target_.region.size() != target_.args.size()) return;
    for (size_t d = 0; d < target_.args.size(); ++d) {
      const LoopVariable& v = target_.region[d];
      const auto extent = constant_extent(v.range());
      if (!extent || static_cast<double>(*extent) >= unknown_elements ||
          std::ranges::find(f->args, target_.args[d]) == f->args.end())
        continue;
      f->schedule.estimates.push_back(
          {target_.args[d], simplify(v.min), extent_of(v.range()), {}, {}});
    }
  }

  // ---- long sums ----

  void widen() {
    for (Type& t : types_) {
      is_wide_ |= t.bits() < 64;
      t = Float(64, t.lanes());
    }
  }
  void round_once() {
    result_.accumulator = result_.func;
    result_.helpers.push_back(result_.accumulator);
    result_.func = new_func(name_);
    std::vector<Expr> values = values_of(result_.accumulator, args_);
    for (size_t k = 0; k < values.size(); ++k) values[k] = cast_to(target_.types[k], values[k]);
    define_pure(result_.func, args_, values);
    note_traits(result_.func, values);
  }

  // ---- definitions ----

  void define_pointwise(const std::vector<Contribution>& contributions,
                        const std::vector<Expr>& initial) {
    std::vector<Expr> values(types_.size());
    for (size_t k = 0; k < initial.size(); ++k) {
      if (initial[k].defined()) values[k] = cast_to(types_[k], initial[k]);
    }
    for (const Contribution& c : contributions) {
      if (!c.gather.is_pointwise()) continue;
      const auto k = static_cast<size_t>(c.component);
      const Expr& where = c.gather.predicate;
      const bool is_border = where.defined() && holds_in_a_border(where, target_.region);
      const Expr term = is_border ? make_select(where, c.adjoint, make_zero(c.adjoint.type()))
                                  : masked(where, c.adjoint);
      add_term(values[k], values[k].defined() ? cast_to(values[k].type(), term) : term);
    }
    for (size_t k = 0; k < values.size(); ++k) {
      values[k] = values[k].defined() ? cast_to(types_[k], values[k]) : make_zero(types_[k]);
    }
    define_pure(result_.func, args_, values);
    result_.stages.push_back(Accumulation::Pointwise);
  }

  // Whether the terms are added in float32 blocks before a sum in double. A scatter has no blocks, because data decide
  // how many of its terms meet in one element.
  bool has_blocks(const Iterations& update) const {
    return is_wide_ && !update.over.scatters && is_long(update) &&
           std::ranges::all_of(target_.types, [](Type t) { return t == Float(32); });
  }
  // Moves the terms into a Func of blocks; what remains of the update adds the blocks. Returns false if there are no
  // blocks.
  bool take_blocks(const std::vector<Expr>& point, int lanes, std::vector<ReductionVariable>& rvars,
                   std::vector<Expr>& terms, Expr& predicate) {
    const auto sum = sum_in_blocks(name_, target_.name, point, rvars, terms, predicate);
    if (!sum) return false;
    sum->block->made->lanes = lanes;
    estimate(sum->block);
    result_.helpers.push_back(sum->block);
    rvars = sum->rvars;
    terms = sum->values;
    predicate = Expr();
    return true;
  }

  void add_update(const Iterations& update) {
    auto [place, sums] = update.all;
    std::vector<ReductionVariable> rvars = update.rvars;
    Expr predicate;
    if (rvars.empty()) {
      for (Expr& term : sums) {
        if (term.defined()) term = masked(update.predicate, term);
      }
    } else if (update.predicate.defined()) {
      predicate = with_likely_parts(update.predicate, rvars);
    }
    if (has_blocks(update))
      take_blocks(parts_point(update.over, args_, {}, {}), 0, rvars, sums, predicate);
    append_sums(result_.func, place, sums, rvars, predicate);
    result_.stages.push_back(update.over.scatters ? Accumulation::Scatter : Accumulation::Gather);
  }

  // parts(lane, y..., part) accumulates a slice of the reduction domain; then adj(y...) sums over lanes and parts.
  // Dimensions whose index is fixed on the left-hand side need no y.
  void add_privatised(const Iterations& update, const PartPlan& plan) {
    const Gather& g = update.over;
    FuncPtr parts = new_func(claim_name(name_ + "_parts"), Role::Accumulator);
    Expr part = plan.has_parts ? variable(unique_name("part")) : Expr(),
         lane = plan.has_lanes ? variable(unique_name("lane")) : Expr();
    define_pure(parts, parts_point(g, args_, lane, part), mapped(types_, make_zero));
    estimate(parts);
    if (lane.defined()) parts->made->lanes = lane_count;

    parts->made->has_parts = part.defined();
    Slice slice = slice_of(update, lane, part, plan, has_blocks(update));
    const auto& [place, sums] = update.all;
    if (update.predicate.defined()) {
      slice.conditions.push_back(
          substitute(with_likely_parts(update.predicate, update.rvars), slice.place));
    }
    const auto here = [&](const Expr& e) { return e.defined() ? substitute(e, slice.place) : e; };
    const std::vector<Expr> element = mapped(place, here);
    std::vector<Expr> terms = mapped(sums, here);
    Expr predicate = conjunction(slice.conditions);
    const std::vector<Expr> lhs = parts_point(g, element, lane, part);
    if (has_blocks(update) && take_blocks(lhs, parts->made->lanes, slice.rvars, terms, predicate))
      add_lanes_in_pairs(parts, lane, terms);
    append_sums(parts, lhs, terms, slice.rvars, predicate);
    result_.helpers.push_back(parts);
    sum_parts(g, parts, plan);
    if (!plan.note.empty()) result_.notes.push_back(plan.note);
  }
  // Adds pairs of lanes of blocks before the sums in double. This halves the number of those sums, each of which costs
  // a conversion, an addition and a memory round trip.
  static void add_lanes_in_pairs(const FuncPtr& parts, const Expr& lane, std::vector<Expr>& terms) {
    if (!lane.defined()) return;
    const int half = parts->made->lanes / 2;
    const Substitution other{{lane.as<Variable>()->name, lane + half}};
    for (Expr& term : terms) {
      if (term.defined()) term = term + substitute(term, other);
    }
    parts->made->lanes = half;
  }
  void sum_parts(const Gather& g, const FuncPtr& parts, const PartPlan& plan) {
    const DomainPtr rdom = make_domain();
    const Expr zero = make_zero(Int(32)), lanes = make_const(Int(32), parts->made->lanes);
    const Expr lane = plan.has_lanes ? add_loop(rdom, "lane", zero, lanes) : Expr(),
               part = plan.has_parts ? add_loop(rdom, "part", zero, plan.count) : Expr();
    const std::vector<Expr>& lhs = g.scatters ? args_ : g.lhs;
    append_sums(result_.func, lhs, values_of(parts, parts_point(g, lhs, lane, part)), rdom->vars,
                {});
    result_.stages.push_back(Accumulation::Privatised);
  }

  const AdjointTarget& target_;
  std::string name_;
  std::vector<Type> types_;  // types of accumulation
  bool is_wide_ = false;     // wider than the target's
  std::vector<Expr> args_;
  AdjointFunc result_;
};

}  // namespace

namespace {

// Adds the Funcs and facts of a sum that `result` reads.
void include(AdjointFunc& result, const AdjointFunc& sum) {
  append(result.helpers, sum.helpers);
  append(result.notes, sum.notes);
  append(result.stages, sum.stages);
}

AdjointFunc make_sum(const AdjointTarget& target, const std::string& name,
                     std::vector<Contribution> contributions, const std::vector<Expr>& initial) {
  write_out_choices(contributions);
  join_borders(contributions, target);
  leave_zeros_to_adjoints(contributions, target);
  AdjointFunc read;  // the sums that the adjoint reads
  for (const ConstantPlaces& places : take_constant_places(contributions, target)) {
    const AdjointFunc sums = make_sum(places.target, name + "_places", places.terms, {});
    include(read, sums);
    read.helpers.push_back(sums.func);
    const std::vector<Expr> values = values_of(sums.func, variables_of(places.target.args));
    append(contributions, contributions_of(places, target, values));
  }
  share_domains(contributions);
  for (Contribution& c : contributions) c.gather = with_safe_places(c.gather, target);
  AdjointFunc result = Builder(target, name).build(contributions, initial);
  append(read.helpers, result.helpers);
  result.helpers = std::move(read.helpers);
  append(result.notes, read.notes);
  append(result.stages, read.stages);
  return result;
}

// Adds what is summed by phases of a stride to `result`. Returns the contributions that are left, which read these sums
// element by element.
std::vector<Contribution> with_phases_apart(const AdjointTarget& target, const std::string& name,
                                            std::vector<Contribution> contributions,
                                            AdjointFunc& result) {
  for (const PhasedSum& sum : take_phased_sums(target, contributions)) {
    const AdjointFunc phases = make_adjoint(sum.target, name + "_phases", sum.contributions);
    append(result.helpers, phases.helpers);
    result.helpers.push_back(phases.func);
    append(result.notes, phases.notes);
    result.notes.push_back(text("summed by phases of the period ", sum.period, " in ",
                                quoted(phases.func->name), ", so that no vector divides"));
    std::set<int> components;
    for (const Contribution& c : sum.contributions) components.insert(c.component);
    Gather each;
    each.lhs = variables_of(target.args);
    each.pure.assign(target.args.size(), true);
    for (const int k : components)
      contributions.push_back({k, each, call_value(phases.func, sum.place, k)});
  }
  return contributions;
}

}  // namespace

AdjointFunc make_adjoint(const AdjointTarget& target, const std::string& name,
                         const std::vector<Contribution>& all_contributions,
                         const std::vector<Expr>& initial) {
  AdjointFunc phased;
  const std::vector<Contribution> contributions =
      with_phases_apart(target, name, all_contributions, phased);
  std::vector<std::vector<Contribution>> groups = running_groups(contributions);
  std::vector<Expr> so_far = initial;
  std::vector<FuncPtr> helpers = std::move(phased.helpers);
  std::vector<std::string> notes = std::move(phased.notes);
  const std::vector<Expr> args = variables_of(target.args);
  for (size_t g = 0; g + 1 < groups.size(); ++g) {
    const AdjointFunc sum = make_sum(target, name + "_so_far", std::move(groups[g]), so_far);
    append(helpers, sum.helpers);
    append(notes, sum.notes);
    if (!sum.accumulator) helpers.push_back(sum.func);
    so_far = values_of(sum.accumulator ? sum.accumulator : sum.func, args);
  }
  AdjointFunc result = make_sum(target, name, std::move(groups.back()), so_far);
  append(helpers, result.helpers);
  append(notes, result.notes);
  result.helpers = std::move(helpers);
  result.notes = std::move(notes);
  return result;
}

}  // namespace retrograde::autodiff
