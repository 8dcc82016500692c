// Integer expressions as sums: factor1 * atom1 + factor2 * atom2 + ... + constant. There are two
// kinds.
//
// Plain sums (sum_of), for all integer types, are exact modulo 2^bits. Index types (Int(32),
// Int(64)) do not overflow; for them, a factor or constant beyond half the type's range makes the
// sum invalid. Otherwise moving a sentinel like INT_MAX to the other side of a comparison could
// overflow where the program did not. Terms keep the order in which they were found.
//
// Linear sums, for index types only, also take divisions apart. Their numbers
// have 64 bits whatever the type; one that does not fit makes the sum invalid. Terms are in
// structural order, so equal sums have equal text.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

struct Term {
  Expr atom;  // not a sum, difference, constant or product with a constant
  int64_t factor = 1;
};

struct Sum {
  Type type = Int(32);
  std::vector<Term> terms;  // structurally different atoms, no factor 0
  // Factors and the constant are sign-extended from the type's width, also for unsigned types.
  int64_t constant = 0;
  bool valid = true;
  bool is_linear = false;

  bool is_constant() const { return terms.empty(); }
  bool may_be_extreme() const;  // whether some atom may be extreme, see below
  const Term* find(const Expr& atom) const;
  // The factor of the atom that is this Variable; 0 when there is none.
  int64_t factor_of(const std::string& variable) const;
  void add(const Expr& atom, int64_t factor);
  void add_constant(__int128 value);
  void add(const Sum& other, int64_t factor);

 private:
  int64_t fit(__int128 value);
};

// Larger sums are not gathered, so that a chain of n additions costs O(n).
constexpr size_t max_terms = 24;

inline bool is_index_type(Type type) { return type.is_int() && type.bits() >= 32; }
inline bool has_sums(Type type) { return type.is_int_or_uint() && !type.is_bool(); }

bool is_extreme(Type type, int64_t value);
// Whether an extreme constant such as INT_MAX takes part in the value, searched `depth` levels
// deep. Such values are not moved across comparisons.
bool may_be_extreme(const Expr& e, int depth);

// Expects an expression whose sums are gathered already, as simplified ones are.
Sum sum_of(const Expr& e);
// The linear sum `constant`, or factor * atom, to add terms to.
Sum linear_sum(Type type, int64_t constant);
Sum linear_sum(const Expr& atom, int64_t factor = 1);
Sum plus(const Sum& a, const Sum& b, int64_t factor_of_b = 1);
Sum times(const Sum& a, int64_t factor);
Sum constant_sum(Type type, int64_t value);
// Positive terms come first, then the constant. Linear sums are in structural order, plain ones in
// the order of canonical_less. Undefined when a number of a linear sum does not fit the type.
Expr to_expr(const Sum& sum);
// sum = divisor * quotient + remainder, for divisor > 0. `quotient` has the terms and the multiple of the
// constant that the divisor divides; the constant of `remainder` lies in [0, divisor).
struct DividedSum {
  Sum quotient, remainder;
};
DividedSum divide_terms(const Sum& sum, int64_t divisor);
// The greatest common divisor of the factors; 0 when there are none.
int64_t common_factor(const Sum& sum);

// The canonical order of commutative operands: variables by name, then other expressions.
bool canonical_less(const Expr& a, const Expr& b);
// The operands of a nest of one associative operator; only `e` itself when the nest is large.
std::vector<Expr> operands_of(Kind kind, const Expr& e);

}  // namespace retrograde::ir
