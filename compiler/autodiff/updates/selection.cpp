#include "autodiff/updates/selection.h"

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

class SelectionFinder {
 public:
  SelectionFinder(const FuncPtr& f, int stage)
      : f_(f), stage_(stage), definition_(f->stage(stage)) {}

  std::optional<Selection> find() {
    Expr condition;
    std::vector<Expr> taken(f_->types.size());
    for (size_t k = 0; k < f_->types.size(); ++k) {
      Expr value = without_lets(definition_.values[k]);
      if (is_self(value, static_cast<int>(k))) continue;
      auto choice = as_choice(value, static_cast<int>(k));
      if (!choice || (condition.defined() && !equal(condition, choice->first))) return std::nullopt;
      condition = choice->first;
      taken[k] = choice->second;
    }
    if (!condition.defined() || !reads_own_point(condition)) return std::nullopt;
    Selection result{make_winner(condition), static_cast<int>(f_->types.size()), taken};
    return result;
  }

 private:
  // {condition under which the new value is taken, new value}
  using Choice = std::pair<Expr, Expr>;

  bool is_self(const Expr& e, int k) const { return is_old_value(e, *f_, definition_, k); }
  bool reads_own_point(const Expr& e) const {
    return !any_node(e, [&](const Expr& node) {
      return as_call_of(node, f_.get()) && !is_old_value(node, *f_, definition_);
    });
  }

  std::optional<Choice> as_choice(const Expr& e, int k) const {
    if (const auto* n = e.as<Max>()) return pick(n->a > n->b, n->a, n->b, k);
    if (const auto* n = e.as<Min>()) return pick(n->a < n->b, n->a, n->b, k);
    if (const auto* n = e.as<Select>()) return pick(n->condition, n->when_true, n->when_false, k);
    return std::nullopt;
  }
  // Matches condition ? a : b where one branch is the old value.
  std::optional<Choice> pick(const Expr& condition, const Expr& a, const Expr& b, int k) const {
    if (is_self(a, k) && !calls(b, f_.get())) return Choice{logical_not(condition), b};
    if (is_self(b, k) && !calls(a, f_.get())) return Choice{condition, a};
    return std::nullopt;
  }

  FuncPtr make_winner(const Expr& condition) const {
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
    values.push_back(
        make_select(call_instead(condition, f_, w), iteration_number(definition_.rvars), old));
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
