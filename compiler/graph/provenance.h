// provenance.h -- where a Func comes from that no user wrote, and what is known of its values.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::graph {

enum class Role : uint8_t {
#define RETROGRADE_ROLE(Name, text) Name,
#include "graph/roles.def"
};
inline constexpr int role_count = 0
#define RETROGRADE_ROLE(Name, text) +1
#include "graph/roles.def"
    ;
const char* role_name(Role role);  // "adjoint", as IR text has it

// What multiplies an adjoint, or a tangent, must beware of.
struct AdjointTraits {
  // Exactly 0 where a consumer chose another branch or reads nothing: a factor may be infinite or
  // NaN there.
  bool masked = false;
  // Exactly 0 where an operand of a consumer is infinite, as that of exp(-inf): a factor that may
  // be infinite meets it there.
  bool vanished = false;
  // The same within the expression that is swept: a product of reads may have overflowed there.
  bool levelled = false;
  // Infinite where it passed the pole of a partial: a factor may be 0 there, as in a norm at 0.
  bool singular = false;
  // Of tangents: infinite where a value that they passed is, and a later partial may be 0 there.
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

// A part of the iterations of an update: what each evaluates, and how often it runs at each point
// of the pure dimensions.
struct AdjointWork {
  std::vector<Expr> values;  // of each write: its place, then its values
  std::vector<Expr> loops;   // extents
};

struct Provenance {
  Role role = Role::Adjoint;
  std::string of;  // the Func that it was made for; may be empty
  AdjointTraits traits;
  std::vector<AdjointWork> work;  // of its last update, where a table says what iterations do
  int lanes = 0;  // of private parts: extent of the first dimension, in which lanes add apart
  bool has_parts = false;  // of private parts: its last dimension numbers them
  int blocks = 0;  // of a block, which adds few of the terms of a long sum: its last dimensions,
                   // which number blocks
};

}  // namespace retrograde::graph
