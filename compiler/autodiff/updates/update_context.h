// update_context.h -- facts about one update that all ways of differentiating it share: its definition without lets,
// the elements it writes, and the adjoint after it.
#pragma once

#include <string>
#include <vector>

#include "autodiff/sums/generated_definitions.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "autodiff/updates/update.h"
#include "graph/definitions/own_reads.h"
#include "ir/memory_reads.h"

namespace retrograde::autodiff {

bool depends_on_data(const Expr& e);  // whether it calls a Func or reads an image
std::string point_text(const std::string& name, const std::vector<Expr>& args);
// `domain`, restricted to where `condition` holds.
IterationDomain restricted(IterationDomain domain, const Expr& condition);

// The number of `place` in `places`, to which a new place is appended. Several values of a Tuple may be read at one
// place.
size_t place_number(std::vector<std::vector<Expr>>& places, const std::vector<Expr>& place);

struct UpdateContext {
  explicit UpdateContext(const UpdateQuery& query);

  const UpdateQuery& query;
  FuncContents* f;
  const Definition& definition;
  IterationDomain domain;
  std::vector<Expr> values, write;  // right- and left-hand side of the update
  std::vector<Expr> point;          // pure variables of f
  std::vector<bool> pure;  // for each dimension: whether it is written at its pure variable

  std::string asked() const;  // first part of error messages
  // The distinct reads of f on the right-hand side. Reads inside of another read's index come first.
  std::vector<Expr> self_reads() const;
  bool reads_self() const { return !self_reads().empty(); }
  // The values of `adjoint` at a place; undefined for values of f that are no floats.
  std::vector<Expr> adjoints_at(const FuncPtr& adjoint, const std::vector<Expr>& place) const;
  std::vector<Expr> adjoints_at_write(const FuncPtr& adjoint) const;
  // Sweeps the values with the adjoints `seeds` (undefined: none) down to reads of f and to wanted leaves.
  SweepResult sweep(const std::vector<Expr>& seeds) const;
  // The same with the adjoint of f at the element written.
  SweepResult sweep_at_write(const FuncPtr& adjoint) const;
  // Sweeps the values of all iterations, whose adjoints `adjoint` holds. The contribution of one iteration to reads of
  // f reaches all earlier iterations, so its traits become those of the adjoint.
  SweepResult sweep_iterations(const FuncPtr& adjoint,
                               FunctionRef<std::vector<Expr>()> seeds) const;
  // The self_reads() whose values a swept partial, an index, or another read's index needs.
  std::vector<Expr> needed_reads(const SweepResult& sweep) const;

  // Throws if no version of f may be kept for `read`.
  void check_versions_are_kept(const Expr& read) const;
  // Takes the memory of `copy`, with these extents, from the budget.
  void take_room(const FuncPtr& copy, const std::vector<Expr>& extents,
                 UpdateAdjoint& result) const;
  // Extents of the region of f that is read; undefined if unknown.
  std::vector<Expr> extents() const;

  // Builds the adjoint of f before the update.
  AdjointFunc adjoint_before(const std::vector<Expr>& initial,
                             const std::vector<Contribution>& contributions = {}) const;
  // Fills in the result if `steps` runs the iterations backward: `seeds` are its values in each iteration, `before`
  // those before all of them.
  void hand_over(const FuncPtr& steps, const std::vector<Expr>& seeds,
                 const std::vector<Expr>& before, UpdateAdjoint& result) const;
  // Adds an explanation that names the update, followed by `what`.
  void note(const std::string& what, UpdateAdjoint& result,
            Explanation::Kind kind = Explanation::Kind::Version) const;
};

// Replaces the subexpressions of `e` that are keys of `values`.
Expr replaced(const Expr& e, const SelfValues& values);
// Replaces reads of f, in an expression of another Func, by `self_values`, else by the final values. The other Func
// then owns its reference to f.
Expr with_values(const Expr& e, const FuncPtr& f, const SelfValues& self_values);

}  // namespace retrograde::autodiff
