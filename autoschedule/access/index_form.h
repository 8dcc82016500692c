// index_form.h -- one index of an access, as an affine form of the iterators of its stage.
//
//   f(2 * x + r - 1)                  terms 2 x + r, constant -1
//   f((x + r) / 2)                    terms x + r, divisor 2
//   f(clamp(x - 1, 0, w))             terms x, constant -1, clamped
//   f(x + flow(x, y))                 terms x, and an opaque term that x and y move
//   f(x * y)                          an opaque term that x and y move
//
// Clamps, boundary conditions and promises are stripped: they change nothing but the places at the border.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "autoschedule/access/value_numbers.h"
#include "ir/interval.h"
#include "ir/visit.h"

namespace retrograde::planning {

struct Term {
  int16_t iterator = 0;
  int64_t coefficient = 1;
  bool operator==(const Term&) const = default;
};

// A summand that is not affine: a value from memory, a parameter, a product of iterators.
struct OpaqueTerm {
  Value value;
  int64_t coefficient = 1;
  Interval range;  // of the value, in all iterations; the ends mention parameters only
  Expr expr;       // the value; undefined in a composed access

  bool operator==(const OpaqueTerm& other) const {
    return value == other.value && coefficient == other.coefficient;
  }
};

// floor((terms + opaque terms + constant) / divisor) mod modulus
struct IndexForm {
  std::vector<Term> terms;         // by iterator, none with coefficient 0
  std::vector<OpaqueTerm> opaque;  // by value
  int64_t low = 0, high = 0;       // the constant; a range once taps are merged
  int64_t divisor = 1, modulus = 0;
  bool clamped = false;
  // Beyond the border it goes on inside of it, as in a mirror, instead of staying at the border.
  bool turned = false;
  // If it is clamped, or not affine: between which elements it lies in all iterations. The ends mention parameters only.
  Interval within;
  Expr expr;  // the index as written, if it is not affine; undefined in a composed access

  bool is_affine() const { return opaque.empty() && divisor == 1 && modulus == 0; }
  bool is_constant() const { return terms.empty() && opaque.empty(); }
  int64_t coefficient(int iterator) const;
  IteratorSet moved_by() const;                   // iterators that move the index
  IteratorSet data_loops() const;                 // iterators that move its data-dependent part
  bool has_data() const;                          // whether values from memory decide it
  bool same_parts(const IndexForm& other) const;  // equal up to the constant and the clamp
  bool operator==(const IndexForm& other) const;
};

IndexForm constant_form(int64_t value);
IndexForm iterator_form(int iterator);
IndexForm opaque_form(OpaqueTerm term);

// The value of an index; `value_of_term` gives that of a summand that is not affine.
Value value_of(const IndexForm& form, ValueNumbers& numbers,
               ir::FunctionRef<Value(const OpaqueTerm&)> value_of_term);

// Sums, products, quotients and remainders of forms; nullopt where the result is not of this form.
std::optional<IndexForm> plus(const IndexForm& a, const IndexForm& b);
std::optional<IndexForm> scaled(const IndexForm& a, int64_t factor);
std::optional<IndexForm> quotient(const IndexForm& a, int64_t divisor);   // divisor > 0
std::optional<IndexForm> remainder(const IndexForm& a, int64_t modulus);  // modulus > 0
// The smallest form that holds both, if they differ in the constant alone.
std::optional<IndexForm> hull(const IndexForm& a, const IndexForm& b);

}  // namespace retrograde::planning
