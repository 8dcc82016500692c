// What every way of differentiating an update looks at: its definition without lets, the places it
// writes, the adjoint after it.
#pragma once

#include <string>
#include <vector>

#include "autodiff/sweeps/made_definitions.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "autodiff/updates/update.h"
#include "graph/own_reads.h"
#include "ir/memory_reads.h"

namespace retrograde::autodiff {

bool depends_on_data(const Expr& e);  // calls a Func or reads an image
std::string point_text(const std::string& name, const std::vector<Expr>& args);
// `domain` where `condition` holds, too.
IterationDomain restricted(IterationDomain domain, const Expr& condition);

// The number of a place among those known, which a new one joins: Tuples read several values at one.
size_t place_number(std::vector<std::vector<Expr>>& places, const std::vector<Expr>& place);

struct UpdateContext {
  explicit UpdateContext(const UpdateQuery& query);

  const UpdateQuery& query;
  FuncContents* f;
  const Definition& definition;
  IterationDomain domain;
  std::vector<Expr> values, write;  // right- and left-hand side
  std::vector<Expr> point;          // the pure variables of f
  std::vector<bool> pure;           // per dimension: written at its own pure variable

  std::string asked() const;  // first part of error messages
  // Distinct reads of f on the right-hand side, those inside of another's index first.
  std::vector<Expr> self_reads() const;
  bool reads_self() const { return !self_reads().empty(); }
  // Values of `adjoint` at a place; undefined for values of f that are no floats.
  std::vector<Expr> adjoints_at(const FuncPtr& adjoint, const std::vector<Expr>& place) const;
  std::vector<Expr> adjoints_at_write(const FuncPtr& adjoint) const;
  // The values, with `seeds` as their adjoints (undefined: none), down to reads of f and to what is
  // wanted.
  SweepResult sweep(const std::vector<Expr>& seeds) const;
  // The same with the adjoint of f at the place written.
  SweepResult sweep_at_write(const FuncPtr& adjoint) const;
  // The values of all iterations, whose adjoints `adjoint` holds: what one iteration passes to the
  // reads of f reaches all earlier ones, so its traits become the adjoint's.
  SweepResult sweep_iterations(const FuncPtr& adjoint,
                               FunctionRef<std::vector<Expr>()> seeds) const;
  // Those of self_reads() whose value is needed by what a sweep found: by a partial, a place, or
  // another read's place.
  std::vector<Expr> needed_reads(const SweepResult& sweep) const;

  // Before a version of f is kept for `read`: throws when none may be.
  void check_versions_are_kept(const Expr& read) const;
  // Takes room for `copy`, with so many elements in each dimension, from the budget.
  void take_room(const FuncPtr& copy, const std::vector<Expr>& extents,
                 UpdateAdjoint& result) const;
  // Extents of what is read of f; undefined ones are not known.
  std::vector<Expr> extents() const;

  // The adjoint of f before the update.
  AdjointFunc adjoint_before(const std::vector<Expr>& initial,
                             const std::vector<Contribution>& contributions = {}) const;
  // The result where `steps` runs the iterations backward: `seeds`, its values at hand in each, and
  // those `before` all of them.
  void hand_over(const FuncPtr& steps, const std::vector<Expr>& seeds,
                 const std::vector<Expr>& before, UpdateAdjoint& result) const;
  // Explains the update, of which `what` goes on to tell.
  void note(const std::string& what, UpdateAdjoint& result,
            Explanation::Kind kind = Explanation::Kind::Version) const;
};

// What `values` has other expressions for becomes these.
Expr replaced(const Expr& e, const SelfValues& values);
// Reads of f in an expression that belongs to another Func become what `self_values` says, else the
// final values; f is then owned by that Func.
Expr with_values(const Expr& e, const FuncPtr& f, const SelfValues& self_values);

}  // namespace retrograde::autodiff
