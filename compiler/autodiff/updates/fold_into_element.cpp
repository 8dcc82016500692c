#include "autodiff/updates/fold_into_element.h"

#include <algorithm>

#include "autodiff/updates/numbering.h"
#include "autodiff/updates/versions.h"
#include "frontend/language/var.h"
#include "graph/define.h"
#include "graph/function.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::ir {

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
    const std::vector<Expr> seeds = seeds_after();
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
  static Expr value_of(const FuncPtr& steps, const std::vector<Expr>& point, size_t k) {
    return call_value(steps, point, static_cast<int>(k));
  }

  // A Func with a dimension for steps, which has the values of `from` at one of them.
  FuncPtr begin_steps(const std::string& name, const Expr& at, const FuncPtr& from) const {
    FuncPtr steps = make_func(Role::Steps);
    steps->made->of = f_->name;
    steps->name = claim_name(name);
    std::vector<Expr> zeros, values;
    for (size_t k = 0; k < f_->types.size(); ++k) {
      values.push_back(value_of(from, c_.point, k));
      zeros.push_back(make_zero(values.back().type()));
    }
    define_pure(steps, at_step(variable(step_)), zeros);
    append_update(steps, at_step(at), values, {}, {});
    return steps;
  }

  // A[x, i + 1]
  std::vector<Expr> seeds_after() const {
    std::vector<Expr> seeds;
    for (size_t k = 0; k < f_->types.size(); ++k)
      seeds.push_back(f_->types[k].is_float() ? value_of(adjoint_, at_step(now_ + 1), k) : Expr());
    return seeds;
  }

  void keep_values(const std::vector<Expr>& needed) {
    c_.check_versions_are_kept(needed.front());
    const FuncPtr before = clone_prefix(c_.query.f, c_.query.stage);
    const FuncPtr steps = begin_steps(f_->name + "_steps", make_zero(Int(32)), before);
    int bytes = 0;
    for (Type t : f_->types) bytes += t.bytes();
    for (const Expr& read : c_.self_reads())
      kept_[read] =
          value_of(steps, at_step(now_), static_cast<size_t>(as_call_of(read, f_)->component));
    append_loop(steps, now_ + 1, c_.values, now_, {});
    std::vector<Expr> extents = c_.extents();
    extents.push_back(iteration_count(c_.definition.rvars) + 1);
    c_.take_room(steps, extents, result_);
    for (const Expr& read : needed) result_.self_values[read] = kept_.at(read);
    result_.helpers.push_back(before);
    result_.helpers.push_back(steps);
    explain(text("update ", c_.query.stage - 1, " overwrites values that its partials need: ",
                 quoted(steps->name), " keeps ", bytes, " bytes in each iteration"));
  }

  void append_reverse(const SweepResult& sweep) {
    std::vector<Expr> values;
    for (Type t : adjoint_->types) values.push_back(make_zero(t));
    for (const LeafAdjoint& leaf : sweep.leaves) {
      const Call* call = as_call_of(leaf.leaf, f_);
      if (!call) continue;
      Expr& value = values[static_cast<size_t>(call->component)];
      const Expr term = cast_to(value.type(), leaf.adjoint);
      value = is_zero(value) ? term : value + term;
    }
    Substitution reversed;
    for (const ReductionVariable& r : c_.definition.rvars)
      reversed[r.var] = mirrored(r, variable(r.var));
    append_loop(adjoint_, now_, values, now_ + 1, reversed);
  }

  // steps[x, to] <- values where an iteration writes, else steps[x, from]; in the order given.
  void append_loop(const FuncPtr& steps, const Expr& to, const std::vector<Expr>& values,
                   const Expr& from, const Substitution& order) {
    auto rdom = std::make_shared<ReductionDomainContents>();
    rdom->frozen = true;
    const Substitution names = add_copies(rdom, c_.definition.rvars);
    const auto here = [&](const Expr& e) {
      return with_values(substitute(substitute(e, order), names), c_.query.f, {});
    };
    std::vector<Expr> chosen, place;
    for (size_t k = 0; k < values.size(); ++k) {
      Expr value = cast_to(steps->types[k], kept(values[k]));
      if (c_.domain.predicate.defined())
        value = make_select(kept(c_.domain.predicate), value, value_of(steps, at_step(from), k));
      chosen.push_back(here(value));
    }
    for (const Expr& e : at_step(to)) place.push_back(here(e));
    append_update(steps, place, chosen, rdom->vars, {});
  }

  // Reads of f are those of the values kept.
  Expr kept(const Expr& e) const { return replaced(e, kept_); }

  void hand_over(const std::vector<Expr>& seeds) {
    std::vector<Expr> before;
    for (size_t k = 0; k < f_->types.size(); ++k)
      before.push_back(value_of(adjoint_, at_step(make_zero(Int(32))), k));
    result_.previous = make_adjoint(c_.query.target, name_before(*f_, c_.query.stage), {}, before);
    result_.helpers.push_back(adjoint_);
    result_.values = c_.values;
    result_.keeps_steps = true;
    result_.seeds = seeds;
    result_.domains = {c_.domain};
    explain(text("update ", c_.query.stage - 1, " folds its domain into each element: ",
                 quoted(adjoint_->name), " keeps the adjoint before each iteration"));
  }

  void explain(const std::string& detail) {
    result_.explanations.push_back({Explanation::Kind::Version, f_->name, detail});
  }

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  const std::string step_;  // name of the last dimension
  const Expr now_;          // number of the iteration
  FuncPtr adjoint_;
  SelfValues kept_;
};

}  // namespace

bool is_fold(const UpdateContext& c) {
  const bool everywhere = std::all_of(c.pure.begin(), c.pure.end(), [](bool p) { return p; });
  const std::vector<Expr> reads = c.self_reads();
  return everywhere && !c.definition.rvars.empty() &&
         std::all_of(reads.begin(), reads.end(), [&](const Expr& read) {
           return same_args(as_call_of(read, c.f)->args, c.write);
         });
}

void differentiate_fold(const UpdateContext& context, UpdateAdjoint& result) {
  Fold(context, result).run();
}

}  // namespace retrograde::ir
