// associativity.cpp -- assembles the proof of an update from the proofs of its components.
#include "analysis/associativity.h"

#include <algorithm>

#include "analysis/component_proof.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::analysis {

namespace {

// ---- explanations of failures ----

// The first operation in the update for which no law is known; empty when there is none.
std::string obstacle_in(const Component& c) {
  for (const Expr& value : c.update) {
    std::string found;
    walk(value, [&](const Expr& e) {
      const Binary* b = e.as<Binary>();
      if (b && (b->kind == Kind::Div || b->kind == Kind::Mod))
        found = b->kind == Kind::Div ? "it divides the old value" : "it takes a remainder of it";
      const Call* call = e.as<Call>();
      if (call && !is_bitwise(e) && !call->is_op(Op::likely))
        found = text("it passes the old value to ", call->name);
      if (e.as<Cast>()) found = "it converts the old value to another type and back";
      return found.empty();
    });
    if (!found.empty()) return found;
  }
  return "";
}

// The form of the update, and the operation in it for which no law is known.
std::string why_not(const Component& c) {
  std::string form;
  for (size_t i = 0; i < c.size(); i++) form += text(i ? ", " : "", c.xs[i], " = ", c.update[i]);
  bool reads_old = false;
  for (const Expr& value : c.update) {
    for (const std::string& x : c.xs) reads_old = reads_old || uses_variable(value, x);
  }
  if (!reads_old)
    return text("it replaces the old value (", form, "), and replacing has no identity");
  const std::string obstacle = obstacle_in(c);
  return text("it is of the form ", form, ", which ",
              obstacle.empty() ? "is not proven to be an associative operator with an identity"
                               : "cannot be proven associative: " + obstacle);
}

Expr identity_value(Unit unit, Type type, bool is_sum) {
  switch (unit) {
    case Unit::Zero:  // -0.0 + x is x for every float, also for -0.0
      return type.is_float() && is_sum ? make_const(type, -0.0) : make_zero(type);
    case Unit::One:
      return make_one(type);
    case Unit::Highest:
      return type.max();
    case Unit::Lowest:
      return type.min();
    case Unit::True:
      return const_true();
    case Unit::False:
      return const_false();
    case Unit::Ones:
      return type.is_uint() ? make_uint_const(type, type.max_uint()) : make_const(type, -1);
    case Unit::Any:
      return {};
  }
  internal_error("an identity of unknown kind");
}

// ---- the whole update ----

class Prover {
 public:
  Prover(const std::vector<Expr>& values, const std::vector<std::string>& xs)
      : values_(values), xs_(xs) {
    op_.xs = xs;
    op_.values.resize(values.size());
    op_.identity.resize(values.size());
    op_.commutative = true;
    for (size_t i = 0; i < values.size(); i++) op_.ys.push_back(unique_name("y"));
  }

  AssociativityProof run() {
    std::vector<std::vector<int>> groups = components_of(values_, xs_);
    for (size_t k = 0; k < groups.size(); k++) {
      if (prove_group(groups[k])) continue;
      const std::vector<int> larger = with_sharing(groups, k);
      if (larger.size() > groups[k].size() && prove_group(larger)) continue;
      proof_.why_not = why_not(component(groups[k]));
      return proof_;
    }
    proof_.op = std::move(op_);
    return proof_;
  }

 private:
  const std::vector<Expr>& values_;
  const std::vector<std::string>& xs_;
  AssociativeOp op_;
  AssociativityProof proof_;

  // Whether the value is unchanged and no other value of its group depends on it.
  bool is_unchanged(const std::vector<int>& group) const {
    const Variable* v = values_[group[0]].as<Variable>();
    return group.size() == 1 && v && v->name == xs_[group[0]];
  }

  static std::string suffix(const std::vector<int>& group, size_t k) {
    return group.size() > 1 ? std::to_string(k) : "";
  }

  Component component(const std::vector<int>& group) const {
    Component c;
    Substitution rename;
    Abstraction abstraction(xs_);
    for (size_t k = 0; k < group.size(); k++) {
      c.xs.push_back("x" + suffix(group, k));
      c.ys.push_back("y" + suffix(group, k));
      rename[xs_[group[k]]] = variable(c.xs[k], values_[group[k]].type());
    }
    for (const int i : group) c.update.push_back(substitute(abstraction(values_[i]), rename));
    c.gs = abstraction.unknowns;
    for (const Expr& value : c.update)
      walk(value, [&](const Expr& e) { return !(c.bitwise = c.bitwise || is_bitwise(e)); });
    return c;
  }

  bool prove_group(const std::vector<int>& group) {
    if (is_unchanged(group)) {
      op_.values[group[0]] = values_[group[0]];
      return true;
    }
    const Component c = component(group);
    const std::optional<Accepted> accepted = prove(c);
    if (!accepted) return false;
    Substitution back;
    for (size_t k = 0; k < group.size(); k++) {
      const Type type = values_[group[k]].type();
      back[c.xs[k]] = variable(xs_[group[k]], type);
      back[c.ys[k]] = variable(op_.ys[group[k]], type);
    }
    for (size_t k = 0; k < group.size(); k++) {
      const Expr& value = accepted->candidate.values[k];
      op_.values[group[k]] = substitute(value, back);
      op_.identity[group[k]] =
          identity_value(accepted->candidate.identity[k], values_[group[k]].type(),
                         group.size() == 1 && value.as<Add>());
    }
    op_.breaks_ties = op_.breaks_ties || accepted->breaks_ties;
    if (!accepted->commutative) {
      op_.commutative = false;
      proof_.why_not_commutative = "its operator depends on the order of its operands";
    }
    return true;
  }

  // The group and all groups that share an unknown with it: x -> a x + b composes only as a pair.
  std::vector<int> with_sharing(const std::vector<std::vector<int>>& groups, size_t k) const {
    const auto components = mapped(groups, [&](const auto& group) { return component(group); });
    std::vector<bool> taken(groups.size());
    std::vector<size_t> queue{k};
    taken[k] = true;
    for (size_t at = 0; at < queue.size(); at++) {
      for (size_t other = 0; other < groups.size(); other++) {
        if (taken[other] || !share_unknown(components[queue[at]], components[other])) continue;
        taken[other] = true;
        queue.push_back(other);
      }
    }
    std::vector<int> result;
    for (const size_t group : queue)
      result.insert(result.end(), groups[group].begin(), groups[group].end());
    std::ranges::sort(result);
    return result;
  }

  static bool share_unknown(const Component& a, const Component& b) {
    for (const auto& [name_a, e] : a.gs) {
      for (const auto& [name_b, f] : b.gs) {
        if (e.type() == f.type() && !is_const(e) && equal(e, f)) return true;
      }
    }
    return false;
  }
};

}  // namespace

AssociativityProof prove_associative(const std::vector<Expr>& values,
                                     const std::vector<std::string>& xs) {
  return Prover(values, xs).run();
}

}  // namespace retrograde::analysis
