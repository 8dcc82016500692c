#include "analysis/never_meet.h"

#include <isl/constraint.h>
#include <isl/ctx.h>
#include <isl/local_space.h>
#include <isl/options.h>
#include <isl/set.h>
#include <isl/space.h>
#include <isl/val.h>

#include <map>
#include <memory>
#include <unordered_set>
#include <utility>

#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::analysis {

namespace {

constexpr unsigned long most_operations = 1'000'000;  // isl's limit, about a second
constexpr size_t most_unknowns = 60, most_quick_unknowns = 16;
constexpr int most_tests = 100;
constexpr int max_depth = 16;  // of nested divisions and minima

Sum number(int64_t value) { return linear_sum(Int(64), value); }

// A conjunction of conditions on integers.
class Conditions {
 public:
  explicit Conditions(ProofEffort effort)
      : most_unknowns_(effort == ProofEffort::Full ? most_unknowns : most_quick_unknowns) {}

  Sum unknown() {
    const std::string name = text("u", numbers_.size());
    numbers_.emplace(name, static_cast<int>(numbers_.size()));
    return linear_sum(variable(name, Int(64)));
  }
  // A sum that overflowed gives no condition.
  void is_zero(const Sum& sum) {
    if (sum.valid) equalities_.push_back(sum);
  }
  void at_least_zero(const Sum& sum) {
    if (sum.valid) inequalities_.push_back(sum);
  }

  // One of the two is zero.
  void either_is_zero(const Sum& a, const Sum& b) {
    if (a.valid && b.valid) choices_.push_back({a, b});
  }

  // Whether the sum is certainly negative under the conditions so far, choices aside.
  bool exclude(const Sum& sum) {
    if (!sum.valid || numbers_.size() > most_unknowns_) return false;
    inequalities_.push_back(sum);
    const bool result = are_empty();
    inequalities_.pop_back();
    return result;
  }

  // Whether the conditions certainly have no solution. Choices are made one after the other, those of the last
  // coordinates first: they tell steps apart.
  bool contradict() {
    if (numbers_.size() > most_unknowns_ || ++tests_ > most_tests) return false;
    if (are_empty()) return true;
    if (choices_.empty()) return false;
    const auto [a, b] = choices_.back();
    choices_.pop_back();
    bool result = true;
    for (const Sum& chosen : {a, b}) {
      equalities_.push_back(chosen);
      result = result && contradict();
      equalities_.pop_back();
    }
    choices_.emplace_back(a, b);
    return result;
  }

 private:
  bool are_empty() const {
    std::unique_ptr<isl_ctx, void (*)(isl_ctx*)> ctx(isl_ctx_alloc(), isl_ctx_free);
    isl_options_set_on_error(ctx.get(), ISL_ON_ERROR_CONTINUE);
    isl_ctx_set_max_operations(ctx.get(), most_operations);
    isl_space* space = isl_space_set_alloc(ctx.get(), 0, static_cast<unsigned>(numbers_.size()));
    isl_basic_set* set = isl_basic_set_universe(isl_space_copy(space));
    isl_local_space* local = isl_local_space_from_space(space);
    for (const Sum& sum : equalities_)
      set = constrained(set, isl_constraint_alloc_equality(isl_local_space_copy(local)), sum);
    for (const Sum& sum : inequalities_)
      set = constrained(set, isl_constraint_alloc_inequality(isl_local_space_copy(local)), sum);
    isl_local_space_free(local);
    const bool is_empty = isl_basic_set_is_empty(set) == isl_bool_true;
    isl_basic_set_free(set);
    return is_empty;
  }

  std::unordered_map<std::string, int> numbers_;  // the numbers of the unknowns
  std::vector<Sum> equalities_, inequalities_;
  std::vector<std::pair<Sum, Sum>> choices_;
  int tests_ = 0;
  const size_t most_unknowns_;

  isl_basic_set* constrained(isl_basic_set* set, isl_constraint* constraint, const Sum& sum) const {
    isl_ctx* ctx = isl_basic_set_get_ctx(set);
    for (const auto& [unknown, factor] : sum.terms) {
      constraint = isl_constraint_set_coefficient_val(constraint, isl_dim_set,
                                                      numbers_.at(unknown.as<Variable>()->name),
                                                      isl_val_int_from_si(ctx, factor));
    }
    constraint =
        isl_constraint_set_constant_val(constraint, isl_val_int_from_si(ctx, sum.constant));
    return isl_basic_set_add_constraint(set, constraint);
  }
};

using Known = std::map<Expr, Sum, StructuralLess>;

// Translates expressions at one of the two points to sums over unknowns.
class Point {
 public:
  // `shared`: unknowns that are equal at both points, as are the variables in `fixed`.
  Point(Conditions& conditions, Known& shared, const MeetingPoints& points,
        const std::unordered_set<std::string>& fixed, const Expr& where)
      : conditions_(conditions), shared_(shared) {
    for (const auto& v : points.variables) {
      if (!fixed.count(v.name)) varying_.insert(v.name);
    }
    for (const auto& v : points.variables) {
      const Sum here = of(variable(v.name));
      if (v.min.defined()) conditions_.at_least_zero(plus(here, of(v.min), -1));
      if (v.max.defined()) conditions_.at_least_zero(plus(of(v.max), here, -1));
    }
    for (const Expr& condition : points.conditions) require(condition);
    if (where.defined()) require(where);
  }

  Sum of(const Expr& e) {
    if (!has_linear_form(e.type())) return atom(e);
    const Sum form = linear_form(e);
    Sum result = number(form.constant);
    for (const Term& term : form.terms) result.add(atom(term.atom), term.factor);
    return result;
  }

 private:
  Conditions& conditions_;
  Known& shared_;
  Known own_;
  std::unordered_set<std::string> varying_;
  int depth_ = 0;

  // Equal expressions are one unknown: no store happens between two reads at a point, and
  // expressions that do not vary read data that is complete.
  Sum atom(const Expr& e) {
    Known& known = uses_any_variable(e, varying_) ? own_ : shared_;
    if (const auto* found = find_or_null(known, e)) return *found;
    const Sum sum = new_atom(e);
    return known.emplace(e, sum).first->second;
  }

  Sum new_atom(const Expr& e) {
    if (depth_ == max_depth) return conditions_.unknown();
    depth_++;
    const Sum sum = decompose(e);
    depth_--;
    return sum;
  }

  Sum decompose(const Expr& e) {
    if (const Call* call = e.as<Call>())
      return call->is_marker() ? of(call->args[0]) : unknown_of_type(e.type());
    if (const Cast* cast = e.as<Cast>()) return converted(*cast);
    const Binary* op = e.as<Binary>();
    if (!op || !has_linear_form(e.type())) return unknown_of_type(e.type());
    if (e.kind() == Kind::Min || e.kind() == Kind::Max) return extreme(*op, e.kind());
    const auto divisor = as_const_int(op->b);
    const bool divides = e.kind() == Kind::Div || e.kind() == Kind::Mod;
    if (!divides || !divisor || *divisor <= 0 || *divisor > INT32_MAX)
      return unknown_of_type(e.type());
    if (e.kind() == Kind::Div) return divided(op->a, *divisor);
    return plus(of(op->a), atom(binary(Kind::Div, op->a, op->b)), -*divisor);
  }

  Sum unknown_of_type(Type type) {
    const Sum sum = conditions_.unknown();
    if (!type.is_int_or_uint() || type.bits() > 32) return sum;
    conditions_.at_least_zero(plus(sum, number(type.min_int()), -1));
    conditions_.at_least_zero(plus(number(type.max_int()), sum, -1));
    return sum;
  }

  // A cast that preserves every value is looked through.
  Sum converted(const Cast& cast) {
    const Type from = cast.value.type();
    const bool keeps = from.is_int_or_uint() && cast.type.can_represent(from);
    return keeps ? of(cast.value) : unknown_of_type(cast.type);
  }

  // divisor * quotient <= e < divisor * (quotient + 1)
  Sum divided(const Expr& e, int64_t divisor) {
    const Sum quotient = conditions_.unknown(), rest = plus(of(e), quotient, -divisor);
    conditions_.at_least_zero(rest);
    conditions_.at_least_zero(plus(number(divisor - 1), rest, -1));
    return quotient;
  }

  // Many clamps decide nothing, given the domain and the condition of the access: each choice that is left doubles the
  // tests.
  Sum extreme(const Binary& op, Kind kind) {
    for (const bool first : {true, false}) {
      const Expr &taken = first ? op.a : op.b, &other = first ? op.b : op.a;
      const Sum excess = plus(of(taken), of(other), -1);
      // The other operand would have to be smaller in a minimum, larger in a maximum.
      const Sum wins = kind == Kind::Min ? excess : plus(number(0), excess, -1);
      if (conditions_.exclude(plus(wins, number(1), -1))) return of(taken);
    }
    const Sum result = conditions_.unknown();
    for (const Expr& side : {op.a, op.b}) {
      conditions_.at_least_zero(kind == Kind::Min ? plus(of(side), result, -1)
                                                  : plus(result, of(side), -1));
    }
    conditions_.either_is_zero(plus(result, of(op.a), -1), plus(result, of(op.b), -1));
    return result;
  }

  // Comparisons give conditions; others are ignored.
  void require(const Expr& condition) {
    std::vector<Expr> conjuncts;
    add_conjuncts(condition, conjuncts);
    for (const Expr& conjunct : conjuncts) {
      if (const Call* call = conjunct.as<Call>(); call && call->is_marker()) {
        require(call->args[0]);
        continue;
      }
      const Binary* op = conjunct.as<Binary>();
      if (op && has_linear_form(op->a.type())) compare(conjunct.kind(), of(op->a), of(op->b));
    }
  }

  void compare(Kind kind, const Sum& a, const Sum& b) {
    const Sum a_minus_b = plus(a, b, -1), b_minus_a = plus(b, a, -1);
    const Sum one = number(1);
    if (kind == Kind::EQ) conditions_.is_zero(a_minus_b);
    if (kind == Kind::LE) conditions_.at_least_zero(b_minus_a);
    if (kind == Kind::LT) conditions_.at_least_zero(plus(b_minus_a, one, -1));
    if (kind == Kind::GE) conditions_.at_least_zero(a_minus_b);
    if (kind == Kind::GT) conditions_.at_least_zero(plus(a_minus_b, one, -1));
  }
};

// Variables that are the same coordinate in both accesses. They are equal where the points meet,
// and so are the values read at them.
std::unordered_set<std::string> common_coordinates(const std::vector<Expr>& a,
                                                   const std::vector<Expr>& b) {
  std::unordered_set<std::string> names;
  for (size_t d = 0; d < a.size(); d++) {
    const Variable *v = a[d].as<Variable>(), *w = b[d].as<Variable>();
    if (v && w && v->name == w->name) names.insert(v->name);
  }
  return names;
}

}  // namespace

bool can_prove_never_meet(const MeetingPoints& points, const PointOrder& order, const Access& a,
                          const Access& b) {
  std::unordered_set<std::string> fixed = common_coordinates(a.at, b.at);
  for (const auto* differing : {&order.larger, &order.smaller}) {
    for (const std::string& loop : *differing) fixed.erase(loop);
  }
  fixed.insert(order.same.begin(), order.same.end());
  Conditions conditions(points.effort);
  Known shared;
  Point first(conditions, shared, points, fixed, a.where);
  Point second(conditions, shared, points, fixed, b.where);
  const auto step = [&](const std::string& loop, int64_t sign) {
    const Sum steps = plus(second.of(variable(loop)), first.of(variable(loop)), -1);
    conditions.at_least_zero(plus(number(-1), steps, sign));
  };
  for (const std::string& loop : order.larger) step(loop, 1);
  for (const std::string& loop : order.smaller) step(loop, -1);
  for (size_t d = 0; d < a.at.size(); d++)
    conditions.is_zero(plus(first.of(a.at[d]), second.of(b.at[d]), -1));
  return conditions.contradict();
}

bool can_prove_never_meet(const MeetingPoints& points, const std::string& loop, const Access& a,
                          const Access& b, const std::unordered_set<std::string>& same) {
  return can_prove_never_meet(points, PointOrder{same, {loop}, {}}, a, b) &&
         can_prove_never_meet(points, PointOrder{same, {}, {loop}}, a, b);
}

}  // namespace retrograde::analysis
