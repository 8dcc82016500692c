// atomic_update.h -- recognises stores that combine an element with a value by one operation.
// Such stores stay vectors, and one atomic instruction does them.
#pragma once

#include <optional>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

// f[i] = f[i] op term1 op term2 ...
struct UpdateChain {
  Kind kind;         // Add, Mul, Min, Max, And, Or; Call for a bitwise operator
  Op op = Op::none;  // bitwise_and, bitwise_or, bitwise_xor
  Expr own;          // f[i]
  struct Term {
    Expr value;       // reads nothing of f
    bool is_negated;  // Add: subtracted
  };
  std::vector<Term> terms;  // the last applied comes first
};
// Follows the operand chain down to the load of f[i]; every other operand on the way is a term.
// Returns nothing for a store of another form.
std::optional<UpdateChain> find_update_chain(const Store& store);

// f[i] = f[i] op operand
struct AtomicUpdate {
  Kind kind;  // as in UpdateChain
  Op op = Op::none;
  Expr operand;             // reads nothing of f
  bool is_negated = false;  // f[i] - operand
};

// For integers this also accepts a chain of one associative operation, whose operands are combined.
// Returns nothing for a store of another form.
std::optional<AtomicUpdate> find_atomic_update(const Store& store);
// The new value of an element that holds `old`, with `operand` in place of update.operand.
Expr updated(const AtomicUpdate& update, const Expr& old, const Expr& operand);

// Whether one atomic instruction can exchange a value of the type.
bool is_one_word(Type type);

// Whether the body of an Atomic stores to several elements of a buffer, or reads an element of a
// buffer that it stores to elsewhere. Such updates conflict even between different iterations.
bool touches_several_elements(const Stmt& update);

bool loads_from(const Expr& e, const std::string& buffer);

}  // namespace retrograde::ir
