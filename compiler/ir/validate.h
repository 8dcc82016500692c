// What must hold in each phase of lowering; run after every pass in tests and debug builds.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {
enum class Phase : uint8_t {
  Loops,        // Realize, Provide, calls to Funcs and images
  FlatStorage,  // Allocate, Store, Load; no calls to Funcs or images
  Vector,       // as FlatStorage, and no Vectorized or Unrolled loops are left
};
// Throws InternalError that names the pass, the rule, the node and the IR around it. `free_names`:
// names bound outside (arguments of the lowered function). `before`: what the pass was given, which
// the error brings along; undefined: nothing was. Checks: types of operands agree, every
// variable is bound once and before use, names are unique, every allocation's loads and stores lie
// inside its Allocate and before its Free, kinds belong to the phase, predicates are bool with
// matching lanes, operator arities.
void validate(const Stmt& s, Phase phase, const std::string& after_pass,
              const std::vector<std::string>& free_names = {}, const Stmt& before = {});
}  // namespace retrograde::ir
