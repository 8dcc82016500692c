// atomic_update.h -- the form of a store that changes an element by one operation: what lowering
// keeps as a vector, and code generation makes an instruction of.
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
  std::vector<Term> terms;  // the last first
};
// Follows the operand that loads f[i] down; everything beside the way is a term. None when the
// store has another form.
std::optional<UpdateChain> find_update_chain(const Store& store);

// f[i] = f[i] op operand
struct AtomicUpdate {
  Kind kind;  // as of a chain
  Op op = Op::none;
  Expr operand;             // reads nothing of f
  bool is_negated = false;  // f[i] - operand
};

// Of integers also a chain of one associative operation: the operands are put together. None when
// the store has another form.
std::optional<AtomicUpdate> find_atomic_update(const Store& store);
// What the element `old` becomes by it, with `operand` in place of its own.
Expr updated(const AtomicUpdate& update, const Expr& old, const Expr& operand);

// Whether one instruction can exchange a value of the type.
bool is_one_word(Type type);

// Whether the body of an Atomic stores to several elements of a buffer, or reads one of a buffer that
// it stores to elsewhere: such updates meet wherever they are.
bool touches_several_elements(const Stmt& update);

bool loads_from(const Expr& e, const std::string& buffer);

}  // namespace retrograde::ir
