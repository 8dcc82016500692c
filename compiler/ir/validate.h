// Checks the invariants of each phase of the IR; runs after every pass in tests and debug builds.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {
enum class Phase : uint8_t {
  Nests,        // like Loops, but a name may be bound again, also inside of its scope
  Loops,        // Realize, Provide, calls of Funcs and images
  FlatStorage,  // Allocate, Store, Load; no calls of Funcs or images
  Vector,       // like FlatStorage, without Vectorized or Unrolled loops
};
// Throws InternalError that names the pass, the rule, the node and the IR around it. `free_names`
// are bound outside (arguments of the lowered function). `before` is the input of the pass, which
// the error shows; undefined when there is none. Checks:
// - types of operands agree; predicates are bool with matching lanes; operators have their arity
// - every variable is bound once and before use; names are unique
// - loads and stores of an allocation lie inside its Allocate and before its Free
// - node kinds belong to the phase
void validate(const Stmt& s, Phase phase, const std::string& after_pass,
              const std::vector<std::string>& free_names = {}, const Stmt& before = {});
}  // namespace retrograde::ir
