// component_proof.h -- an associative operator for one component of an update: candidates are
// proposed, and the laws of each are proven by cases (associativity_laws.h).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analysis/update_component.h"

namespace retrograde::analysis {

// What an element of an identity may be.
enum class Unit : uint8_t { Zero, One, Highest, Lowest, True, False, Ones, Any };

struct Candidate {
  std::vector<Expr> values;  // over xs and ys
  std::vector<Unit> identity;
};

struct Accepted {
  Candidate candidate;
  bool commutative = false;
  bool breaks_ties = false;
};

// The first candidate that is associative, has its identity, and that the update follows from:
// F(x, g) == op(x, F(identity, g)). Ties: of equal extremes another may win than in the order of
// the update; values stay the same.
std::optional<Accepted> prove(const Component& c);

}  // namespace retrograde::analysis
