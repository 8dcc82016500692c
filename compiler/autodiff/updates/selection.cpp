#include "autodiff/updates/selection.h"

#include <algorithm>

#include "autodiff/sums/generated_definitions.h"
#include "autodiff/updates/versions.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {

// Iterations for which vectors of them pay.
constexpr int64_t many_iterations = 64;

class SelectionFinder {
 public:
  SelectionFinder(const FuncPtr& f, int stage)
      : f_(f), stage_(stage), definition_(f->stage(stage)) {}

  std::optional<Selection> find() {
    Expr condition;
    std::optional<Extreme> extreme;
    std::vector<Expr> taken(f_->types.size());
    for (size_t k = 0; k < f_->types.size(); ++k) {
      Expr value = without_lets(definition_.values[k]);
      if (is_self(value, static_cast<int>(k))) continue;
      auto choice = as_choice(value, static_cast<int>(k));
      if (!choice || (condition.defined() && !equal(condition, choice->condition)))
        return std::nullopt;
      condition = choice->condition;
      extreme = choice->extreme;
      taken[k] = choice->value;
    }
    if (!condition.defined() || !reads_own_point(condition)) return std::nullopt;
    if (f_->types.size() > 1 || !is_long()) extreme.reset();
    Selection result{make_winner(condition, extreme), static_cast<int>(f_->types.size()), taken};
    return result;
  }

 private:
  // How a new value compares with the old one in a maximum or minimum.
  struct Extreme {
    Expr is_better, is_worse;
    bool last_wins = false;  // of equal values
  };
  struct Choice {
    Expr condition;  // under which the new value is taken
    Expr value;      // the new one
    std::optional<Extreme> extreme;
  };

  bool is_self(const Expr& e, int k) const { return is_old_value(e, *f_, definition_, k); }
  bool reads_own_point(const Expr& e) const {
    return !any_node(e, [&](const Expr& node) {
      return as_call_of(node, f_.get()) && !is_old_value(node, *f_, definition_);
    });
  }

  std::optional<Choice> as_choice(const Expr& e, int k) const {
    if (const auto* n = e.as<Max>()) return pick_extreme(n->a > n->b, n->b > n->a, n->a, n->b, k);
    if (const auto* n = e.as<Min>()) return pick_extreme(n->a < n->b, n->b < n->a, n->a, n->b, k);
    if (const auto* n = e.as<Select>()) return pick(n->condition, n->when_true, n->when_false, k);
    return std::nullopt;
  }
  // Matches condition ? a : b where one branch is the old value.
  std::optional<Choice> pick(const Expr& condition, const Expr& a, const Expr& b, int k) const {
    if (is_self(a, k) && !calls(b, f_.get())) return Choice{logical_not(condition), b, {}};
    if (is_self(b, k) && !calls(a, f_.get())) return Choice{condition, a, {}};
    return std::nullopt;
  }
  std::optional<Choice> pick_extreme(const Expr& a_wins, const Expr& b_wins, const Expr& a,
                                     const Expr& b, int k) const {
    auto choice = pick(a_wins, a, b, k);
    if (!choice) return choice;
    const bool is_last = is_self(a, k);
    choice->extreme = is_last ? Extreme{b_wins, a_wins, true} : Extreme{a_wins, b_wins, false};
    return choice;
  }

  bool is_long() const {
    int64_t iterations = 1;
    for (const ReductionVariable& r : definition_.rvars) {
      const int64_t extent = as_const_int(r.extent).value_or(many_iterations);
      iterations =
          std::min(many_iterations, iterations * std::clamp<int64_t>(extent, 1, many_iterations));
    }
    return iterations >= many_iterations;
  }

  // The same as the condition if iterations run in their order, in which numbers increase. Equal extremes are decided
  // by their numbers instead of the order, so that a schedule can run the iterations in vectors.
  static Expr in_any_order(const Extreme& extreme, const Expr& number, const Expr& old) {
    const Expr is_as_good = logical_not(extreme.is_worse);
    return extreme.last_wins ? is_as_good && (extreme.is_better || number > old)
                             : extreme.is_better || (is_as_good && number < old);
  }

  FuncPtr make_winner(const Expr& condition, const std::optional<Extreme>& extreme) const {
    FuncPtr w = make_func(Role::Winner, f_->name + "_winner", f_->name);
    std::vector<Expr> args = variables_of(f_->args);
    std::vector<Expr> initial =
        stage_ > 1 ? values_of(clone_prefix(f_, stage_), args) : f_->pure->values;
    initial.push_back(make_const(Int(32), -1));
    define_pure(w, args, initial);
    std::vector<Expr> values = mapped(
        definition_.values, [&](const Expr& e) { return call_instead(without_lets(e), f_, w); });
    int index = static_cast<int>(f_->types.size());
    Expr old = call_value(w, definition_.args, index);
    const Expr number = iteration_number(definition_.rvars);
    const Expr wins = extreme ? in_any_order(*extreme, number, old) : condition;
    values.push_back(make_select(call_instead(wins, f_, w), number, old));
    append_update(w, definition_.args, values, definition_.rvars, definition_.predicate);
    return w;
  }

  FuncPtr f_;
  int stage_;
  const Definition& definition_;
};

}  // namespace

std::optional<Selection> find_selection(const FuncPtr& f, int stage) {
  return SelectionFinder(f, stage).find();
}

}  // namespace retrograde::autodiff
