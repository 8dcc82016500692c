// provenance.h -- why the compiler created a Func, and which special values it may hold.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::graph {

enum class Role : uint8_t {
#define RETROGRADE_ROLE(Name, text) Name,
#include "graph/definitions/roles.def"
};
inline constexpr int role_count = 0
#define RETROGRADE_ROLE(Name, text) +1
#include "graph/definitions/roles.def"
    ;
const char* role_name(Role role);  // the role in IR text: "adjoint"

// Special values of an adjoint or tangent that the factors multiplied with it must respect.
struct AdjointTraits {
  // Exactly 0 where a consumer selected another branch or reads nothing; a factor may be infinite
  // or NaN there.
  bool masked = false;
  // Exactly 0 where an operand of a consumer is infinite, as for exp(-inf); a factor may be
  // infinite there.
  bool vanished = false;
  // Vanished, within the expression that is differentiated: a product of reads may have overflowed
  // there.
  bool levelled = false;
  // Infinite where it passed the pole of a partial; a factor may be 0 there, as in a norm at 0.
  bool singular = false;
  // For tangents: infinite where a value on their path is infinite; a later partial may be 0 there.
  bool infinite = false;
  bool operator==(const AdjointTraits& other) const = default;
  void add(const AdjointTraits& other) {
    masked |= other.masked;
    vanished |= other.vanished;
    levelled |= other.levelled;
    singular |= other.singular;
    infinite |= other.infinite;
  }
};

// The work of one group of an update's iterations: what each iteration evaluates, and how often it
// runs at each point of the pure dimensions.
struct AdjointWork {
  std::vector<Expr> values;  // for each write, its coordinates and its values
  std::vector<Expr> loops;   // extents of the loops
};

struct Provenance {
  Role role = Role::Adjoint;
  std::string of;  // the Func that it was created for; may be empty
  AdjointTraits traits;
  std::vector<AdjointWork> work;  // of its last update, if a table selects what each iteration does
  int lanes = 0;  // privatised copies: extent of dimension 0, in which vector lanes add separately
  bool has_parts = false;  // the last dimension numbers privatised copies
  // Split sums: how many of the last dimensions number blocks, each of which adds few terms.
  int blocks = 0;
};

}  // namespace retrograde::graph
