// kept_start.h -- the nest of loops that gives the elements of an update their first values, made to fill
// the registers that these are kept in.
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
  // nullopt: the loops of the nest are not those of the update one by one, under the same conditions.
  // `around`: lets in which the update stands, and the nest does not.
  static std::optional<KeptStart> of(const KeptUpdate& update, const Substitution& around,
                                     const Stmt& nest,
                                     const std::function<bool(const For&)>& is_pure);

  // The same for an array of the elements, whose coordinates are the update's lanes, the last first.
  Stmt filling(const Stmt& nest, const std::string& array, const KeptUpdate& update) const;

 private:
  bool descend(const Stmt& s, const KeptUpdate& update,
               const std::function<bool(const For&)>& is_pure);
  // Along each dimension as many loops as the update has, of the same extents.
  bool pair_loops(const KeptUpdate& update, const Substitution& around);
  // As the update writes it.
  Expr renamed(const Expr& e) const;
  bool is_at(const KeptUpdate& update, const Substitution& around) const;
  bool has_conditions_of(const KeptUpdate& update, const Substitution& around) const;

  const Provide* provide_ = nullptr;
  std::vector<const For*> loops_;  // outermost first
  std::vector<Expr> conditions_;
  Substitution lets_, names_;  // names: of the update's lanes, by the loops here
  std::map<const For*, const For*> of_lane_;
};

}  // namespace retrograde::lower
