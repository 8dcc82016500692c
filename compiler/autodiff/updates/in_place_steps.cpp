#include "autodiff/updates/in_place_steps.h"

#include <algorithm>
#include <bit>
#include <unordered_set>

#include "autodiff/borders/border_conditions.h"
#include "autodiff/updates/numbering.h"
#include "autodiff/updates/recurrence.h"
#include "autodiff/updates/versions.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/definitions/race_checks.h"
#include "graph/function.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// The loops of an update, innermost first.
struct Loops {
  std::vector<ReductionVariable> points, steps;

  std::vector<std::string> names() const {
    std::vector<std::string> all = mapped(points, &ReductionVariable::var);
    append(all, mapped(steps, &ReductionVariable::var));
    return all;
  }
};

Loops divided(const std::vector<ReductionVariable>& rvars, unsigned steps) {
  Loops loops;
  for (size_t i = 0; i < rvars.size(); ++i)
    (steps >> i & 1u ? loops.steps : loops.points).push_back(rvars[i]);
  return loops;
}

class InPlaceSteps {
 public:
  InPlaceSteps(const UpdateContext& context, UpdateAdjoint& result)
      : c_(context), f_(context.f), result_(result), step_(unique_name("step")) {}

  bool run() {
    if (!find_loops() || !covers_the_region()) return false;
    needed_ = c_.needed_reads(c_.sweep_at_write(c_.query.adjoint.func));
    if (!needed_.empty() && !c_.query.versions.keeps_any()) return false;  // a tape may need fewer
    check_numbers(c_, least_iterations(loops_.steps) + 1, "the kept steps of an update");
    now_ = iteration_number(loops_.steps);
    count_ = iteration_count(loops_.steps);
    make_steps();
    Regions regions = c_.query.regions;
    Box box = regions.of(f_);
    box.push_back({make_zero(Int(32)), count_});
    regions.add(steps_, box);
    const AdjointTarget target = target_of_steps(regions);
    const AdjointFunc after = make_adjoint(target, f_->name + "_adj_steps", {}, last_step());
    const UpdateQuery query{
        steps_,         1, regions, target, after, true, c_.query.versions, {}, c_.query.is_wanted,
        c_.query.ranges};
    const UpdateContext inner(query);
    UpdateAdjoint found;
    found.current = after;
    if (!differentiate_recurrence(inner, found)) return false;
    keep_values();
    hand_over(inner, found);
    return true;
  }

 private:
  // ---- whether the update has this shape ----

  // Finds the points with as few steps as possible.
  bool find_loops() {
    const auto& rvars = c_.definition.rvars;
    if (rvars.size() < 2 || rvars.size() > most_variables) return false;
    const unsigned all = (1u << rvars.size()) - 1;
    for (int count = 1; count < static_cast<int>(rvars.size()); ++count) {
      for (unsigned bits = all; bits-- > 0;) {
        if (std::popcount(bits) != count) continue;
        loops_ = divided(rvars, bits);
        if (are_independent() && are_in_place()) return true;
      }
    }
    return false;
  }
  bool are_independent() const {
    const auto steps = mapped(loops_.steps, &ReductionVariable::var);
    const std::unordered_set<std::string> around(steps.begin(), steps.end());
    return std::ranges::all_of(loops_.points,
                               [&](const ReductionVariable& r) {
                                 return graph::can_prove_race_free(*f_, c_.definition, r.var,
                                                                   around);
                               }) &&
           graph::can_prove_same_order(*f_, c_.definition,
                                       mapped(c_.definition.rvars, &ReductionVariable::var),
                                       loops_.names());
  }
  // Whether all steps write the same elements.
  bool are_in_place() const {
    return std::ranges::none_of(c_.write, [&](const Expr& place) {
      return depends_on_data(place) || std::ranges::any_of(loops_.steps, [&](const auto& r) {
               return uses_variable(place, r.var);
             });
    });
  }

  // Whether the points of a step are a good part of the elements that each step would keep. Those of a triangular
  // domain become fewer from step to step; a residue, as of red-black orders, keeps a good part.
  bool covers_the_region() const {
    std::vector<Expr> conditions;
    add_conjuncts(c_.domain.predicate, conditions);
    for (const Expr& condition : conditions) {
      if (is_range_condition(condition) && std::ranges::any_of(loops_.steps, [&](const auto& r) {
            return uses_variable(condition, r.var);
          }))
        return false;
    }
    const Box& box = c_.query.regions.of(f_);
    for (size_t d = 0; d < box.size(); ++d) {
      if (!box[d].is_bounded()) return false;
      const bool moves = c_.pure[d] || std::ranges::any_of(loops_.points, [&](const auto& r) {
                           return uses_variable(c_.write[d], r.var);
                         });
      const auto extent = constant_extent(box[d]);
      if (!moves && (!extent || *extent > few)) return false;
      const auto written = constant_extent(bounds_of(c_.write[d], scope_of(c_.domain.vars)));
      if (extent && written && *extent > few * *written) return false;
    }
    return true;
  }

  // ---- the steps ----

  std::vector<Expr> at_step(std::vector<Expr> place, const Expr& step) const {
    place.push_back(step);
    return place;
  }

  void make_steps() {
    before_ = clone_prefix(c_.query.f, c_.query.stage);
    steps_ = make_func(Role::Steps, f_->name + "_steps", f_->name);
    define_pure(steps_, at_step(c_.point, variable(step_)), values_of(before_, c_.point));
    const DomainPtr domain = make_domain();
    std::vector<ReductionVariable> all = loops_.points;
    append(all, loops_.steps);
    const Substitution names = add_copies(domain, all);
    const auto here = [&](const Expr& e) { return substitute(on_steps(e), names); };
    const std::vector<Expr> old = values_of(steps_, at_step(c_.write, now_));
    std::vector<Expr> values;
    for (size_t k = 0; k < old.size(); ++k) {
      Expr value = c_.values[k];
      if (c_.domain.predicate.defined()) value = make_select(c_.domain.predicate, value, old[k]);
      values.push_back(here(value));
    }
    append_update(steps_, mapped(at_step(c_.write, now_ + 1), here), values, domain->vars, {});
  }

  // Redirects reads of f to its elements before the current step.
  Expr on_steps(const Expr& e) const {
    return map_calls_of(e, f_, [&](const Call& call, const std::vector<Expr>& args) {
      return call_value(steps_, at_step(args, now_), call.component);
    });
  }

  AdjointTarget target_of_steps(const Regions& regions) const {
    AdjointTarget target = c_.query.target;
    target.name = steps_->name;
    target.args = steps_->args;
    target.region = regions.loop_variables(steps_.get(), steps_->args);
    return target;
  }

  // The adjoint after the update belongs to the last step.
  std::vector<Expr> last_step() const {
    return mapped(values_of(c_.query.adjoint.func, c_.point), [&](const Expr& a) {
      return make_select(variable(step_) == count_, a, make_zero(a.type()));
    });
  }

  // ---- what others see ----

  // All steps exist only if a partial needs one.
  void keep_values() {
    if (needed_.empty()) return;
    std::vector<Expr> extents = c_.extents();
    extents.push_back(count_ + 1);
    c_.take_room(steps_, extents, result_);
    append(result_.helpers, {before_, steps_});
    c_.note(text(" overwrites values that its partials need: ", quoted(steps_->name),
                 " keeps every step"),
            result_);
  }

  void hand_over(const UpdateContext& inner, UpdateAdjoint& found) {
    append(result_.helpers, found.current.helpers);
    result_.helpers.push_back(found.current.func);
    append(result_.helpers, found.helpers);
    append(result_.helpers, found.previous.helpers);
    result_.helpers.push_back(found.previous.func);
    const auto outside = [&](const Expr& e) { return with_values(e, steps_, found.self_values); };
    result_.values = mapped(found.values, outside);
    result_.seeds = inner.adjoints_at_write(found.current.func);
    result_.domains = found.domains;
    result_.keeps_steps = true;
    result_.previous = adjoint_before(found.previous.func);
    c_.note(text(" overwrites elements in steps: ", quoted(found.current.func->name),
                 " keeps the adjoint of each step"),
            result_);
  }

  // The sum over all steps: elements that no step writes are the same in all of them.
  AdjointFunc adjoint_before(const FuncPtr& of_steps) const {
    Gather later;
    later.lhs = c_.point;
    later.pure.assign(c_.point.size(), true);
    later.rdom = make_domain();
    const Expr step = add_loop(later.rdom, "later", make_one(Int(32)), count_);
    std::vector<Contribution> contributions;
    const std::vector<Expr> values = values_of(of_steps, at_step(c_.point, step));
    for (size_t k = 0; k < values.size(); ++k)
      contributions.push_back({static_cast<int>(k), later, values[k]});
    return c_.adjoint_before(values_of(of_steps, at_step(c_.point, make_zero(Int(32)))),
                             contributions);
  }

  static constexpr size_t most_variables = 5;
  static constexpr int64_t few = 4;

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  const std::string step_;  // name of the step dimension, the last one
  Loops loops_;
  Expr now_, count_;          // number of the current step; number of steps
  std::vector<Expr> needed_;  // reads of f whose values partials need
  FuncPtr before_, steps_;
};

}  // namespace

bool differentiate_in_place_steps(const UpdateContext& context, UpdateAdjoint& result) {
  if (!context.reads_self()) return false;
  return InPlaceSteps(context, result).run();
}

}  // namespace retrograde::autodiff
