// The simplifier: one bottom-up, memoised walk. Each operator has a rule function from simplified
// operands to a simplified result; rules call each other on smaller expressions.
//   rules_sum.cpp      + - *, and cancellation inside sums
//   rules_divide.cpp   / %
//   rules_min_max.cpp  min max
//   rules_compare.cpp  == != < <=
//   rules_logic.cpp    && || ! select
//   rules_other.cpp    casts, vectors, operators, lets
//   names.cpp          values of names bound to index expressions
//   simplify_stmt.cpp  statements
#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>

#include "ir/expr.h"
#include "ir/sum.h"
#include "simplify/facts.h"
#include "simplify/simplify.h"

namespace retrograde::simplification {

class Simplifier {
 public:
  explicit Simplifier(const BoundsMap& bounds);

  Expr operator()(const Expr& e);
  Stmt operator()(const Stmt& s);

 private:
  // ---- rules: operands are simplified and have one type ----
  Expr apply(Kind kind, const Expr& a, const Expr& b);
  Expr apply_rule(Kind kind, const Expr& a, const Expr& b);
  Expr add(const Expr& a, const Expr& b);
  Expr sub(const Expr& a, const Expr& b);
  Expr mul(const Expr& a, const Expr& b);
  Expr div(const Expr& a, const Expr& b);
  Expr mod(const Expr& a, const Expr& b);
  Expr min_max(Kind kind, const Expr& a, const Expr& b);
  Expr distribute_min_max(Kind kind, const std::vector<Expr>& operands);
  bool is_dominated(Kind kind, const Expr& x, const Expr& y);
  void add_operand(Kind kind, const Expr& operand, std::vector<Expr>& operands);
  std::vector<Expr> shifted_operands(Kind kind, const Expr& e);
  Expr equals(const Expr& a, const Expr& b);
  Expr less(Kind kind, const Expr& a, const Expr& b);  // LT or LE
  Expr logical(Kind kind, const Expr& a, const Expr& b);
  Expr negate(const Expr& a);
  Expr select(const Expr& condition, const Expr& t, const Expr& f);
  Expr cast(Type type, const Expr& value);
  Expr call(const Expr& e, const Call& n);
  Expr ramp(const Expr& base, const Expr& stride, int lanes);
  Expr broadcast(const Expr& value, int lanes);
  Expr vector_reduce(const VectorReduce& n);
  Expr let(const Expr& e);
  Expr node(const Expr& e);

  // ---- sums ----
  Expr rebuild(Sum sum, Kind kind, const Expr& a, const Expr& b);
  Expr rebuild(Sum sum);
  bool join_divisions(Sum& sum);
  bool expand_product(Sum& sum);
  Expr push_into_min_max(const Sum& sum);
  Expr gather_vectors(const Sum& sum);
  Expr fold_select(const Sum& sum);
  Expr float_arithmetic(Kind kind, const Expr& a, const Expr& b);

  // ---- divisions, by a constant greater than one ----
  Expr div_by(const Expr& a, int64_t c);
  Expr mod_by(const Expr& a, int64_t c);
  Expr div_vector(const Ramp& a, int64_t c);
  Expr mod_vector(const Ramp& a, int64_t c);
  Expr div_atom(const Sum& rest, int64_t c);
  std::optional<Sum> multiple_below(const Sum& rest, int64_t c);

  // ---- comparisons of index sums ----
  Expr less_than_zero(Sum sum);
  Expr distribute_comparison(const Sum& sum);
  Expr unfold_division(const Sum& sum);
  Expr compare_sides(const Sum& sum);
  Expr compare_vectors(Kind kind, const Expr& a, const Expr& b);

  Expr combine_conditions(Kind kind, const Expr& a, const Expr& b, bool& drop_a, bool& drop_b);
  Expr distribute_broadcast(Kind kind, const Expr& a, const Expr& b);
  Expr constant(const Expr& like, int64_t value) const;

  // ---- names of index values (names.cpp) ----
  std::optional<Sum> find_definition(const Expr& atom);
  const Sum* definition_of(const Expr& atom);
  bool cancel_names(Sum& sum);
  Expr constant_of(const Expr& variable);
  void learn_constants(const Expr& condition, std::vector<std::string>& learned);
  void forget_constants(const std::vector<std::string>& learned);

  // ---- statements ----
  Stmt let_stmt(const Stmt& s);
  Stmt loop(const Stmt& s, const For& n);
  Stmt launch(const Launch& n);
  Stmt block(const Stmt& s, const Block& n);
  Stmt branches(const Stmt& s, const IfThenElse& n);
  Stmt write(const Stmt& s, const Expr& predicate);
  int64_t most_elements(const Expr& count);
  Stmt allocate(const Allocate& n, const Stmt& simplified);
  Stmt children(const Stmt& s);

  // Binds a name during its lifetime; `replacement`, when defined, replaces the name.
  class Binding {
   public:
    Binding(Simplifier& owner, const std::string& name, const Expr& min, const Expr& max,
            const Expr& replacement);
    ~Binding();
    Binding(const Binding&) = delete;
    Binding& operator=(const Binding&) = delete;

   private:
    Simplifier& owner_;
    const std::string name_;
  };
  friend class Binding;
  // Assumes a condition during its lifetime.
  class ScopedCondition {
   public:
    ScopedCondition(Simplifier& owner, const Expr& condition);
    ~ScopedCondition();
    ScopedCondition(const ScopedCondition&) = delete;
    ScopedCondition& operator=(const ScopedCondition&) = delete;

   private:
    Simplifier& owner_;
    Facts::Assumption assumption_;
    std::vector<std::string> learned_;  // names known to be constants here
  };
  void forget() {
    memo_.clear();
    facts_.forget();
  }

  struct Entry {
    Expr key, value;  // the key is kept alive so that its address stays unique
  };
  Facts facts_;
  std::unordered_map<const ExprNode*, Entry> memo_;
  std::unordered_map<std::string, Expr> replacements_;
  std::unordered_set<std::string> seen_names_;
  std::unordered_set<std::string> varying_;  // names bound inside loops
  std::unordered_map<std::string, std::optional<Sum>> definitions_;
  int known_constants_ = 0;  // enclosing branches that determine names to be constants
  int loops_around_ = 0;
  int depth_ = 0;  // of rules that call rules
};

bool has_effect(const Expr& e);  // besides its value
// Whether the value is cheap enough to replace every use of its name.
bool is_trivial_value(const Expr& e);
// Removes lets whose names are not used.
Expr drop_dead_lets(const Expr& e);
Stmt drop_dead_lets(const Stmt& s);

}  // namespace retrograde::simplification
