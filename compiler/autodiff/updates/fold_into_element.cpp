#include "autodiff/updates/fold_into_element.h"

#include <algorithm>

#include "autodiff/updates/numbering.h"
#include "autodiff/updates/versions.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/function.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {

class Fold {
 public:
  Fold(const UpdateContext& context, UpdateAdjoint& result)
      : c_(context),
        f_(context.f),
        result_(result),
        step_(unique_name("step")),
        now_(iteration_number(context.definition.rvars)) {}

  void run() {
    check_numbers(c_, least_iterations(c_.definition.rvars) + 1, "the kept steps of an update");
    adjoint_ = begin_steps(f_->name + "_adj_steps", iteration_count(c_.definition.rvars),
                           result_.current.func);
    if (c_.domain.predicate.defined()) adjoint_->made->traits.masked = true;
    const std::vector<Expr> seeds = c_.adjoints_at(adjoint_, at_step(now_ + 1));  // A[x, i + 1]
    const SweepResult sweep = c_.sweep_iterations(adjoint_, [&] { return seeds; });
    const std::vector<Expr> needed = c_.needed_reads(sweep);
    if (!needed.empty()) keep_values(needed);
    append_reverse(sweep);
    hand_over(seeds);
  }

 private:
  std::vector<Expr> at_step(const Expr& step) const {
    std::vector<Expr> point = c_.point;
    point.push_back(step);
    return point;
  }

  // A Func with one more dimension, for steps; it equals `from` at step `at`.
  FuncPtr begin_steps(const std::string& name, const Expr& at, const FuncPtr& from) const {
    FuncPtr steps = make_func(Role::Steps, name, f_->name);
    define_pure(steps, at_step(variable(step_)), mapped(from->types, make_zero));
    append_update(steps, at_step(at), values_of(from, c_.point), {}, {});
    return steps;
  }

  void keep_values(const std::vector<Expr>& needed) {
    c_.check_versions_are_kept(needed.front());
    const FuncPtr before = clone_prefix(c_.query.f, c_.query.stage);
    const FuncPtr steps = begin_steps(f_->name + "_steps", make_zero(Int(32)), before);
    for (const Expr& read : c_.self_reads())
      kept_[read] = call_value(steps, at_step(now_), as_call_of(read, f_)->component);
    append_loop(steps, now_ + 1, c_.values, now_, {});
    std::vector<Expr> extents = c_.extents();
    extents.push_back(iteration_count(c_.definition.rvars) + 1);
    c_.take_room(steps, extents, result_);
    for (const Expr& read : needed) result_.self_values[read] = kept_.at(read);
    append(result_.helpers, {before, steps});
    c_.note(text(" overwrites values that its partials need: ", quoted(steps->name), " keeps ",
                 total_bytes(f_->types), " bytes in each iteration"),
            result_);
  }

  void append_reverse(const SweepResult& sweep) {
    std::vector<Expr> values = mapped(adjoint_->types, make_zero);
    for (const LeafAdjoint& leaf : sweep.leaves) {
      const Call* call = as_call_of(leaf.leaf, f_);
      if (!call) continue;
      Expr& value = values[static_cast<size_t>(call->component)];
      const Expr term = cast_to(value.type(), leaf.adjoint);
      value = is_zero(value) ? term : value + term;
    }
    append_loop(adjoint_, now_, values, now_ + 1, mirrored(c_.definition.rvars));
  }

  // Appends the update steps[x, to] <- values if the predicate holds, else steps[x, from]. The loop runs in the given
  // order.
  void append_loop(const FuncPtr& steps, const Expr& to, const std::vector<Expr>& values,
                   const Expr& from, const Substitution& order) {
    const DomainPtr domain = make_domain();
    const Substitution names = add_copies(domain, c_.definition.rvars);
    const auto here = [&](const Expr& e) {
      return with_values(substitute(substitute(e, order), names), c_.query.f, {});
    };
    std::vector<Expr> chosen = values_of(steps, at_step(from));
    for (size_t k = 0; k < values.size(); ++k) {
      Expr value = cast_to(steps->types[k], kept(values[k]));
      if (c_.domain.predicate.defined())
        value = make_select(kept(c_.domain.predicate), value, chosen[k]);
      chosen[k] = here(value);
    }
    append_update(steps, mapped(at_step(to), here), chosen, domain->vars, {});
  }

  // Replaces reads of f by the kept values.
  Expr kept(const Expr& e) const { return replaced(e, kept_); }

  void hand_over(const std::vector<Expr>& seeds) {
    c_.hand_over(adjoint_, seeds, values_of(adjoint_, at_step(make_zero(Int(32)))), result_);
    c_.note(text(" folds its domain into each element: ", quoted(adjoint_->name),
                 " keeps the adjoint before each iteration"),
            result_);
  }

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  const std::string step_;  // name of the step dimension, the last one
  const Expr now_;          // number of the current iteration
  FuncPtr adjoint_;
  SelfValues kept_;
};

}  // namespace

bool is_fold(const UpdateContext& c) {
  const bool everywhere = std::ranges::all_of(c.pure, [](bool p) { return p; });
  const std::vector<Expr> reads = c.self_reads();
  return everywhere && !c.definition.rvars.empty() &&
         std::ranges::all_of(reads, [&](const Expr& read) {
           return same_args(as_call_of(read, c.f)->args, c.write);
         });
}

void differentiate_fold(const UpdateContext& context, UpdateAdjoint& result) {
  Fold(context, result).run();
}

}  // namespace retrograde::autodiff
