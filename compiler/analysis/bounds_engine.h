// The engine behind bounds_of and footprints: one memoised interval per node, and child engines for
// code that runs only under a condition.
//
// Meaning of an Interval
//   integers  every value lies between the defined ends
//   floats    the same; with at least one defined end, the value is not NaN
// Ends are built in canonical linear form (linear.h), so differences between ends cancel without
// the simplifier.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/interval.h"
#include "analysis/linear.h"
#include "analysis/scope.h"
#include "ir/expr.h"
#include "ir/node_memo.h"

namespace retrograde::analysis {

class BoundsEngine {
 public:
  BoundsEngine(const Scope<Interval>& variables, const ValueBounds* values);

  Interval bounds(const Expr& e);
  void bind(const Let& let);  // the variable of the body ranges over the value

  enum class Truth { False, True, Unknown };
  Truth truth(const Expr& condition);
  // Whether it mentions a variable of the scope, or a value known only at run time.
  bool varies(const Expr& e);

  // The engine for code that runs only where `condition` is true (or false): comparisons in it
  // narrow the variables of the scope. Returns this engine when nothing is gained or too many
  // engines exist.
  BoundsEngine& under(const Expr& condition, bool is_true);

 private:
  struct Shared {
    const ValueBounds* values;
    int engines_left =
        16;  // nested conditions multiply engines; beyond this many, conditions are ignored
  };
  explicit BoundsEngine(BoundsEngine& outer);

  Interval compute(const Expr& e);
  bool finds_varying(const Expr& e);
  Interval bounds_of_atom(const Expr& atom);
  Interval atom_bounds(const Expr& e);
  Interval cast_bounds(Type type, const Expr& value);
  Interval ramp_bounds(const Ramp& ramp);
  Interval binary_bounds(const Expr& e, const Binary& op);
  Interval select_bounds(const Expr& condition, const Expr& when_true, const Expr& when_false);

  // bounds_of_sums.cpp
  Interval sum_bounds(const Sum& form);
  Interval sum_of_bounds(const Sum& form);
  std::optional<Interval> bounds_by_facts(const Sum& form);
  std::optional<Interval> bounds_by_distribution(const Sum& form);
  void collect_varying(const Sum& form, bool negated, std::vector<std::pair<Expr, bool>>& found);
  bool may_cancel(const Sum& rest, const Sum& side, int64_t factor);
  Sum join_correlated_terms(Sum form);

  // bounds_of_calls.cpp
  Interval call_bounds(const Call& call);
  Interval operator_bounds(const Call& call);
  Interval bounds_within(const Call& call, const OpInfo& info);
  Interval bounds_at_ends(const Call& call, const OpInfo& info);
  Interval bounds_by_rule(const Call& call);
  Interval value_of_func(const Call& call);

  // bounds_under_conditions.cpp
  Truth compare_truth(Kind kind, const Expr& a, const Expr& b);
  // The consequences of a condition: ranges of single variables of the scope, and sums that are <=
  // 0.
  struct Narrowed {
    std::map<std::string, Interval> variables;
    std::vector<Sum> facts;
  };
  void narrow(const Expr& condition, bool is_true, Narrowed& narrowed);
  void narrow_by_comparison(Kind kind, const Expr& a, const Expr& b, Narrowed& narrowed);
  void narrow_nonpositive(const Sum& form, Narrowed& narrowed);

  std::shared_ptr<Shared> shared_;
  Scope<Interval> scope_;
  BoundsEngine* outer_ = nullptr;  // the engine without the condition
  std::vector<Sum> facts_;         // implied by the condition, each <= 0
  static constexpr int most_distributions = 3;
  static constexpr size_t most_varying = 32;
  int distributions_ = 0;  // nesting depth of bounds_by_distribution
  NodeMemo<Interval> memo_;
  NodeMemo<Interval> atoms_;  // for expressions that are not sums
  NodeMemo<bool> varies_;
  struct Child {
    Expr condition;
    bool is_true;
    std::unique_ptr<BoundsEngine> engine;  // null: nothing gained
  };
  std::vector<Child> children_;
};

}  // namespace retrograde::analysis
