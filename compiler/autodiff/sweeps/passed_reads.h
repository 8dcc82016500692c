// Reads of a Func that only looks another one up, as boundary conditions do, in terms of that one.
//
//   bounded(x) = f(clamp(x, 0, n - 1))              next(x) = bounded(x - 1) + bounded(x + 1)
//
// By the adjoint of `bounded`, f_adj would have an update for each side and corner of its box:
//
//   bounded_adj(x) = next_adj(x + 1) + next_adj(x - 1)
//   f_adj(x) = bounded_adj(x);  f_adj(0) += bounded_adj(-1);  f_adj(n - 1) += bounded_adj(n)
//
// With f(clamp(x - 1, 0, n - 1)) in place of bounded(x - 1) it is a stencil as `next` is, once
// borders have joined (join_borders.h):
//
//   f_adj(x) = next_adj(min(x + 1, n - 1)) + next_adj(max(x - 1, 0))
//
// Not for reads that run over reduction variables: their borders would be sums over these, too.
#pragma once

#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// Of a Func by a stage of `reader`, over the variables of `domain`.
struct PassedRead {
  FuncPtr reader;
  LeafAdjoint read;
  IterationDomain domain;
};

// Whether all that f does is to read an element at a place that its coordinates say one by one, or a
// constant where they say so.
bool is_look_up(const FuncContents& f);
// The value that a read of such a Func has, by what this reads.
Expr looked_up(const FuncContents& f, const Call& read);
// Whether the inversion takes few pieces, none of which sums: then it may stand for the inversion of
// two reads one after the other.
bool is_short(const Inversion& inversion);

// Who reads the Funcs that look others up.
class PassedReads {
 public:
  void note(const Symbol* of, PassedRead read) { reads_[of].push_back(std::move(read)); }
  // The Func's adjoint has more than what its readers contribute.
  void close(const Symbol* of) { closed_.insert(of); }
  // Empty where it is closed.
  const std::vector<PassedRead>& of(const Symbol* symbol) const;

 private:
  std::unordered_map<const Symbol*, std::vector<PassedRead>> reads_;
  std::unordered_set<const Symbol*> closed_;
};

}  // namespace retrograde::autodiff
