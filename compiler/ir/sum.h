// Integer expressions as sums: factor1 * atom1 + factor2 * atom2 + ... + constant. Of two kinds:
//
// Sums as they stand (sum_of), of all integer types: exact modulo 2^bits. Index types (Int(32),
// Int(64)) do not overflow; there a factor or constant beyond half of the type's range makes the sum
// invalid: moving a sentinel like INT_MAX to the other side of a comparison would overflow where the
// program did not. Terms are in the order in which they were found.
//
// Linear sums (analysis/linear.h), of index types, which take divisions apart: numbers are those of
// 64 bits whatever the type; one that does not fit makes the sum invalid. Terms are in structural
// order: equal sums have equal text.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

struct Term {
  Expr atom;  // not a sum, a difference, a constant, or a product with a constant
  int64_t factor = 1;
};

struct Sum {
  Type type = Int(32);
  std::vector<Term> terms;  // atoms structurally different, no factor 0
  // Factors and constant are sign-extended from the type's width, unsigned types too.
  int64_t constant = 0;
  bool valid = true;
  bool is_linear = false;

  bool is_constant() const { return terms.empty(); }
  bool may_be_extreme() const;  // some atom is
  const Term* find(const Expr& atom) const;
  // Of the atom that is this Variable, else 0.
  int64_t factor_of(const std::string& variable) const;
  void add(const Expr& atom, int64_t factor);
  void add_constant(__int128 value);
  void add(const Sum& other, int64_t factor);

 private:
  int64_t fit(__int128 value);
};

// Larger sums are left alone, so that a chain of n additions costs O(n).
constexpr size_t max_terms = 24;

inline bool is_index_type(Type type) { return type.is_int() && type.bits() >= 32; }
inline bool has_sums(Type type) { return type.is_int_or_uint() && !type.is_bool(); }

bool is_extreme(Type type, int64_t value);
// Whether an extreme constant takes part in the value, as far as `depth` levels show: then it is
// not moved around.
bool may_be_extreme(const Expr& e, int depth);

// Of an expression whose sums are already gathered, as simplified ones are.
Sum sum_of(const Expr& e);
// `constant`, and factor * atom, to be added to.
Sum linear_sum(Type type, int64_t constant);
Sum linear_sum(const Expr& atom, int64_t factor = 1);
Sum plus(const Sum& a, const Sum& b, int64_t factor_of_b = 1);
Sum times(const Sum& a, int64_t factor);
Sum constant_sum(Type type, int64_t value);
// Positive terms first, then the constant; of linear sums in structural order, else in that of
// canonical_less. Undefined when a number of a linear sum does not fit the type.
Expr to_expr(const Sum& sum);
// sum = divisor * whole + rest, divisor > 0: terms and the multiples in the constant that it divides
// in `whole`, the constant of the rest in [0, divisor).
struct SplitSum {
  Sum whole, rest;
};
SplitSum split_by(const Sum& sum, int64_t divisor);
// The greatest common divisor of the factors; 0 when there are none.
int64_t common_factor(const Sum& sum);

// The order of operands that commute: variables by name, then others.
bool canonical_less(const Expr& a, const Expr& b);
// The operands of a nest of the same associative operator; e itself when the nest is large.
std::vector<Expr> operands_of(Kind kind, const Expr& e);

}  // namespace retrograde::ir
