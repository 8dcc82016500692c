// Replaces names of index values by their definitions where that simplifies.
//
//   let m = t*64 - q in  .. x + t*64 - m ..    =>    x + q          (terms cancel)
//   if (s == 1) { .. i*s .. }                  =>    i              (the branch determines s)
//
// Lets keep the text of bounds small, so a name is expanded only if the number of terms does not
// grow. A value that a branch determines is propagated into lets outside of the branch that derive
// from it. Loop variables, and values derived from them, keep their names in branches: lanes of `if
// (x == 3) f[x]` stay a vector.
#include <algorithm>

#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

namespace {

// Names of larger sums are not expanded.
constexpr size_t max_opened_terms = 8;

// Whether the value is the same wherever its name is in scope, and may be recomputed there.
bool is_steady(const Expr& value) {
  return !any_node(value, [](const Expr& node) {
    const auto* call = node.as<Call>();
    const bool may_change = call && (call->call_type != CallType::Operator ||
                                     op_info(call->op).cls == OpClass::Effect ||
                                     op_info(call->op).cls == OpClass::Internal);
    return may_change || node.kind() == Kind::Load || node.kind() == Kind::Let;
  });
}

}  // namespace

std::optional<Sum> Simplifier::find_definition(const Expr& atom) {
  const std::string& name = atom.as<Variable>()->name;
  const Expr value = value_or(replacements_, name, facts_.value_of(name));
  if (!value.defined() || value.type() != atom.type() || !is_steady(value)) return std::nullopt;
  const Sum sum = sum_of(value);
  Sum opened = constant_sum(atom.type(), sum.constant);
  for (const Term& term : sum.terms) {
    const Sum* inner = definition_of(term.atom);
    inner ? opened.add(*inner, term.factor) : opened.add(term.atom, term.factor);
  }
  if (!opened.valid || opened.terms.size() > max_opened_terms) return std::nullopt;
  return opened;
}

// The definition of a name in terms of names without one; null when the name has none.
const Sum* Simplifier::definition_of(const Expr& atom) {
  const auto* variable = atom.as<Variable>();
  if (!variable || !is_index_type(atom.type()) || atom.type().is_vector()) return nullptr;
  auto found = definitions_.find(variable->name);
  if (found == definitions_.end()) {
    std::optional<Sum> sum = find_definition(atom);
    found = definitions_.emplace(variable->name, std::move(sum)).first;
  }
  return found->second ? &*found->second : nullptr;
}

// Expands one name if fewer terms remain, or two names if some of their terms cancel.
bool Simplifier::cancel_names(Sum& sum) {
  if (!is_index_type(sum.type) || sum.type.is_vector() || sum.terms.size() < 2) return false;
  const auto named =
      filtered(sum.terms, [&](const Term& term) { return definition_of(term.atom); });
  const auto open = [&](Sum& in, const Term& term) {
    in.add(term.atom, -term.factor);
    in.add(*definition_of(term.atom), term.factor);
  };
  const auto is_better = [&](const Sum& opened, size_t most_terms) {
    return opened.valid && opened.terms.size() <= most_terms;
  };
  for (size_t i = 0; i < named.size(); ++i) {
    Sum opened = sum;
    open(opened, named[i]);
    if (is_better(opened, sum.terms.size() - 1)) return sum = std::move(opened), true;
    for (size_t j = i + 1; j < named.size() && opened.valid; ++j) {
      Sum both = opened;
      open(both, named[j]);
      const size_t apart = sum.terms.size() - 2 + definition_of(named[i].atom)->terms.size() +
                           definition_of(named[j].atom)->terms.size();
      if (is_better(both, std::min(sum.terms.size(), apart - 1)))
        return sum = std::move(both), true;
    }
  }
  return false;
}

// The constant that an enclosing branch determines for the name; undefined when there is none.
Expr Simplifier::constant_of(const Expr& variable) {
  if (known_constants_ == 0) return {};
  const Sum* sum = definition_of(variable);
  return sum && sum->is_constant() ? make_const(variable.type(), sum->constant) : Expr();
}

// ---- values that branches determine ----

namespace {

struct Equality {
  std::string name;
  Expr value;
};

std::optional<Equality> as_equality(const Expr& condition) {
  if (condition.kind() != Kind::EQ) return std::nullopt;
  const auto* n = condition.as<Binary>();
  const auto* variable = n->a.as<Variable>();
  if (!variable || !as_const_int(n->b)) return std::nullopt;
  return Equality{variable->name, n->b};
}

}  // namespace

void Simplifier::learn_constants(const Expr& condition, std::vector<std::string>& learned) {
  std::vector<Expr> conjuncts;
  add_conjuncts(condition, conjuncts);
  for (const Expr& conjunct : conjuncts) {
    const auto equality = as_equality(conjunct);
    if (!equality || varying_.count(equality->name)) continue;
    if (replacements_.emplace(equality->name, equality->value).second)
      learned.push_back(equality->name);
  }
  if (learned.empty()) return;
  ++known_constants_;
  definitions_.clear();
}

void Simplifier::forget_constants(const std::vector<std::string>& learned) {
  if (learned.empty()) return;
  for (const std::string& name : learned) replacements_.erase(name);
  --known_constants_;
  definitions_.clear();
}

}  // namespace retrograde::simplification
