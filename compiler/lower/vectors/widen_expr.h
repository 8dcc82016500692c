// Widens expressions of a loop body for vectorization: the result holds the values of all iterations in one vector.
//
// Layout: an expression of L lanes becomes one of N*L lanes, iteration-major: lanes [i*L, (i+1)*L) hold its value in
// iteration i. A Ramp or Broadcast of a vector concatenates its steps: Ramp(b, s, N) is b, b + s, ...
#pragma once

#include <string>
#include <unordered_map>

#include "ir/build.h"
#include "ir/expr.h"
#include "lower/nests/copy_statement.h"

namespace retrograde::lower {

// Lanes [iteration*L, iteration*L + L) of a vector of N*L lanes.
Expr extract_iteration(const Expr& wide, int iteration, int narrow_lanes);
// Every lane of `v` repeated `times` times in place: a b -> a a b b.
Expr repeat_each(const Expr& v, int times);
// Whether `e` calls something that does more than compute a value: print, require, error, ... (random and undef only
// compute values).
bool has_effects(const Expr& e);

class Widener {
 public:
  Widener(const std::string& variable, const Expr& min, int iterations, FreshNames& fresh);

  // The value for all iterations. A value that does not depend on the iteration is returned as the same handle, with
  // L lanes.
  Expr operator()(const Expr& e);
  // Always with N*L lanes.
  Expr spread(const Expr& e);
  int iterations() const { return iterations_; }
  // Whether the value depends on the iteration; false for an undefined expression.
  bool varies(const Expr& e) { return e.defined() && !(*this)(e).same_as(e); }

  // Binds a name that is defined outside of the widened expression: `wide` holds its values in all iterations.
  void bind(const std::string& name, const Expr& wide) { wide_values_[name] = wide; }
  const std::unordered_map<std::string, Expr>& bound() const { return wide_values_; }

  // Declares an allocation of which every iteration has its own copy: element e of iteration i is stored at e*N + i.
  void bind_allocation(const std::string& name) { wide_allocations_.insert(name); }
  bool is_wide_allocation(const std::string& name) const {
    return wide_allocations_.count(name) > 0;
  }
  const std::unordered_set<std::string>& wide_allocations() const { return wide_allocations_; }
  Expr index_in_wide_allocation(const Expr& index);

  // Bool of N lanes: the iterations that run; undefined when all do. Loads that vary are predicated by it. Loads that
  // do not vary stay unpredicated, so the caller guarantees that at least one iteration runs.
  const Expr& mask() const { return mask_; }
  void set_mask(const Expr& mask);
  // The conjunction of `predicate` (may be undefined) and the mask, with N*L lanes.
  Expr masked(const Expr& predicate, int narrow_lanes);

 private:
  Expr widen(const Expr& e);
  Expr widen_binary(const Expr& e, const Binary& n);
  Expr widen_select(const Expr& e, const Select& n);
  Expr widen_load(const Expr& e, const Load& n);
  Expr widen_ramp(const Expr& e, const Ramp& n);
  Expr widen_broadcast(const Expr& e, const Broadcast& n);
  Expr widen_call(const Expr& e, const Call& n);
  Expr widen_branches(const Expr& e, const Call& n);
  Expr widen_extern(const Call& n);
  Expr widen_let(const Expr& e, const Let& n);
  Expr widen_shuffle(const Expr& e, const Shuffle& n);
  Expr under_mask(const Expr& mask, const Expr& e);

  const std::string variable_;
  const int iterations_;
  FreshNames& fresh_;
  Expr mask_;
  bool may_run_nowhere_ =
      false;  // inside an arm of if_then_else: loads that do not vary are masked, too
  NodeMemo<Expr> memo_;
  std::unordered_map<std::string, Expr> wide_values_;
  std::unordered_set<std::string> wide_allocations_, widened_lets_;
};

}  // namespace retrograde::lower
