#include "autodiff/updates/update.h"

#include <isl/cpp.h>

#include <algorithm>

#include "autodiff/time/checkpoint.h"
#include "autodiff/updates/fold_into_element.h"
#include "autodiff/updates/in_place_steps.h"
#include "autodiff/updates/numbering.h"
#include "autodiff/updates/recurrence.h"
#include "autodiff/updates/selection.h"
#include "autodiff/updates/tape.h"
#include "autodiff/updates/update_context.h"
#include "autodiff/updates/versions.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"

namespace retrograde::autodiff {

namespace {

class UpdateDifferentiation {
 public:
  explicit UpdateDifferentiation(const UpdateQuery& q) : c_(q), f_(q.f.get()) {
    result_.current = q.adjoint;
  }

  UpdateAdjoint run() {
    check_points();
    check_predicate();
    bool fixed_places = std::ranges::none_of(c_.write, [&](const Expr& e) { return calls(e, f_); });
    if (fixed_places && (accumulates() || selects() || is_recurrence())) return std::move(result_);
    if (wants_checkpoints(c_)) {
      differentiate_by_checkpoints(c_, result_);
    } else if (is_fold(c_)) {
      differentiate_fold(c_, result_);
    } else if (!fixed_places || !succeeds(differentiate_in_place_steps)) {
      differentiate_by_tape(c_, result_);
    }
    return std::move(result_);
  }

 private:
  void check_points() const {
    if (!point_number(c_.definition)) return;
    unsupported(c_.asked(),
                "adjoints pass backward through iterations that each update one point at a time",
                text("an iteration updates ", number_of_points(c_.definition), " points of ",
                     quoted(f_->name), " at once, from their old values"),
                text("Give the iterations a dimension, as in f(x, t + 1) = ... f(x, t), give ",
                     quoted(f_->name), " a custom_adjoint, or propagate_tangents"));
  }
  void check_predicate() const {
    if (!calls(c_.domain.predicate, f_)) return;
    user_error(c_.asked(),
               "whether an update writes may not depend on the values of the Func that it updates",
               text(quoted(f_->name), " is read in the predicate"),
               "Move the condition into a select on the right-hand side");
  }

  // ---- accumulation ----

  // If e is self + part, where `self` is the call of the element written, returns the part (E of the header); else an
  // undefined Expr.
  Expr added_to(const Expr& e, int k) const {
    if (!calls(e, f_)) return {};
    if (const Call* call = as_call_of(e, f_)) {
      return call->component == k && same_args(call->args, c_.write) ? make_zero(e.type()) : Expr();
    }
    return match(
        e, [&](const Add& n) { return added_in_sum(n.a, n.b, k); },
        [&](const Sub& n) -> Expr {
          if (calls(n.b, f_)) return {};
          Expr rest = added_to(n.a, k);
          return rest.defined() ? rest - n.b : Expr();
        },
        [&](const Select& n) -> Expr {
          if (calls(n.condition, f_)) return {};
          Expr t = added_to(n.when_true, k), f = added_to(n.when_false, k);
          return t.defined() && f.defined() ? make_select(n.condition, t, f) : Expr();
        },
        [&](const Call& n) -> Expr {
          return n.is_marker() && n.op != Op::stop_gradient ? added_to(n.args[0], k) : Expr();
        },
        [&](const ExprNode&) { return Expr(); });
  }
  Expr added_in_sum(const Expr& a, const Expr& b, int k) const {
    if (calls(a, f_) && calls(b, f_)) return {};
    Expr rest = added_to(calls(a, f_) ? a : b, k);
    return rest.defined() ? rest + (calls(a, f_) ? b : a) : Expr();
  }

  bool accumulates() {
    std::vector<Expr> added;
    for (size_t k = 0; k < c_.values.size(); ++k) {
      added.push_back(added_to(c_.values[k], static_cast<int>(k)));
      if (!added.back().defined() && f_->types[k].is_float()) return false;
      // An integer value need not have this form, because integers carry no adjoint. The terms of the floating-point
      // values do not depend on it: they are free of f.
    }
    result_.values = added;
    result_.domains = {c_.domain};
    return true;
  }

  // ---- selection ----

  bool selects() {
    auto selection = find_selection(c_.query.f, c_.query.stage);
    if (!selection) return false;
    check_numbers(c_, least_iterations(c_.definition.rvars),
                  "the iterations of an update that selects");
    Expr mine = iteration_number(c_.definition.rvars);
    FuncPtr winner = selection->winner;
    int index = selection->index_value;
    Expr is_winner = call_value(winner, c_.write, index) == mine;
    Expr untouched = call_value(winner, c_.point, index) < 0;
    std::vector<Expr> initial = values_of(result_.current.func, c_.point);
    result_.values.resize(initial.size());
    for (size_t k = 0; k < initial.size(); ++k) {
      const Expr& taken = selection->taken[k];
      if (!taken.defined()) continue;
      result_.values[k] = make_select(is_winner, taken, make_zero(taken.type()));
      initial[k] = make_select(untouched, initial[k], make_zero(initial[k].type()));
    }
    result_.domains = {c_.domain};
    result_.previous = c_.adjoint_before(initial);
    result_.helpers.push_back(winner);
    c_.note(text(" selects: ", quoted(winner->name),
                 " recomputes which iteration wrote each element last"),
            result_);
    return true;
  }

  // ---- overwriting and recurrences ----

  bool is_recurrence() {
    if (!succeeds(differentiate_recurrence)) return false;
    if (c_.reads_self() && wants_checkpoints(c_)) explain_unused_budget();
    return true;
  }

  // Whether a way to differentiate the update applies. If it does not, or isl exceeds its budget, nothing changes.
  bool succeeds(bool (&differentiate)(const UpdateContext&, UpdateAdjoint&)) {
    UpdateAdjoint trial = result_;
    const VersionBudget untouched = c_.query.versions;
    try {
      if (differentiate(c_, trial)) {
        result_ = std::move(trial);
        return true;
      }
    } catch (const isl::exception& e) {
      c_.note(text(": isl gave up on its index sets: ", e.what()), result_);
    }
    c_.query.versions = untouched;
    return false;
  }

  void explain_unused_budget() {
    c_.note(text(" needs no checkpoints: ", quoted(f_->name),
                 " keeps every step along a dimension of its own, so the budget for checkpoints is "
                 "not used; written in place, as f(x) = g(f(x), t), it is run backward from kept "
                 "states"),
            result_, Explanation::Kind::Performance);
  }

  UpdateContext c_;
  FuncContents* f_;
  UpdateAdjoint result_;
};

}  // namespace

UpdateAdjoint differentiate_update(const UpdateQuery& query) {
  return UpdateDifferentiation(query).run();
}

}  // namespace retrograde::autodiff
