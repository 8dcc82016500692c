// component_proof.h -- finds an associative operator for one component of an update: proposes
// candidates and proves their laws by cases (associativity_laws.h).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analysis/update_component.h"

namespace retrograde::analysis {

// The kinds of constants in an identity.
enum class Unit : uint8_t { Zero, One, Highest, Lowest, True, False, Ones, Any };

struct Candidate {
  std::vector<Expr> values;  // op, over xs and ys
  std::vector<Unit> identity;
};

struct Accepted {
  Candidate candidate;
  bool commutative = false;
  bool breaks_ties = false;
};

// The first candidate that is associative, has its identity, and represents the update: F(x, g) ==
// op(x, F(identity, g)). Ties: another one of several equal extremes may win than in the order of
// the update; the extreme itself is the same.
std::optional<Accepted> prove(const Component& c);

}  // namespace retrograde::analysis
