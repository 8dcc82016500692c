// kept_start.h -- matches the loop nest that initialises the elements of an update, and rewrites it to initialise the
// registers in which keep_accumulators keeps them.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ir/visit.h"
#include "lower/loops/kept_update.h"

namespace retrograde::lower {

class KeptStart {
 public:
  // nullopt if the loops or conditions of the nest do not correspond to those of the update one by one.
  // `around`: lets around the update that are not around the nest.
  static std::optional<KeptStart> of(const KeptUpdate& update, const Substitution& around,
                                     const Stmt& nest,
                                     const std::function<bool(const For&)>& is_pure);

  // The nest that fills `array` instead. The array's coordinates are the update's lanes, innermost first.
  Stmt filling(const Stmt& nest, const std::string& array, const KeptUpdate& update) const;

 private:
  bool descend(const Stmt& s, const KeptUpdate& update,
               const std::function<bool(const For&)>& is_pure);
  // Pairs loops: along each dimension, both have the same number of loops with the same extents.
  bool pair_loops(const KeptUpdate& update, const Substitution& around);
  // The expression in terms of the update's loops.
  Expr renamed(const Expr& e) const;
  bool is_at(const KeptUpdate& update, const Substitution& around) const;
  bool has_conditions_of(const KeptUpdate& update, const Substitution& around) const;

  const Provide* provide_ = nullptr;
  std::vector<const For*> loops_;  // outermost first
  std::vector<Expr> conditions_;
  Substitution lets_, names_;  // names_: loops here to lanes of the update
  std::map<const For*, const For*> of_lane_;
};

}  // namespace retrograde::lower
