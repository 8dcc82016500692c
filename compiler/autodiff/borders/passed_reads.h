// passed_reads.h -- rewrites reads of a Func that only looks another Func up, as boundary conditions do.
//
//   bounded(x) = f(clamp(x, 0, n - 1))              next(x) = bounded(x - 1) + bounded(x + 1)
//
// Through the adjoint of `bounded`, f_adj would have an update for each side and corner of its box:
//
//   bounded_adj(x) = next_adj(x + 1) + next_adj(x - 1)
//   f_adj(x) = bounded_adj(x);  f_adj(0) += bounded_adj(-1);  f_adj(n - 1) += bounded_adj(n)
//
// With f(clamp(x - 1, 0, n - 1)) in place of bounded(x - 1), and after borders are merged (join_borders.h), f_adj is a
// stencil as `next` is:
//
//   f_adj(x) = next_adj(min(x + 1, n - 1)) + next_adj(max(x - 1, 0))
//
// A Func that spreads another one out is passed, too, because most of its elements are zeros that no adjoint needs:
//
//   spread(x) = select(x % 2 == 0, f(x / 2), 0)      out(x) += spread(x - r) * w(r)
//   f_adj(x) += out_adj(2 * x + r) * w(r)             instead of spread_adj(2 * x), a sum at twice as many elements
//
// Not applied to other reads that run over reduction variables: their borders would be sums over these variables, too.
#pragma once

#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// A read of a Func by a stage of `reader`, in terms of the variables of `domain`.
struct PassedRead {
  FuncPtr reader;
  LeafAdjoint read;
  IterationDomain domain;
};

// Whether f only reads an element at indices that are functions of one coordinate each, or a constant where its
// coordinates select that.
bool is_look_up(const FuncContents& f);
// The value of a read of a pure Func, expressed by what that Func reads.
Expr value_of_read(const FuncContents& f, const Call& read);
// Whether the inversion has few pieces, none of which sums. Then it may replace the inversion of two reads in sequence.
bool is_short(const Inversion& inversion);
// Whether a read through a Func that spreads another one out sums no more terms at each element than the read of that
// Func, `direct`. There are fewer elements: an index of the leaf divides.
bool sums_no_more(const Inversion& passed, const LeafAdjoint& leaf, const Inversion& direct);

// The reads of the Funcs that look others up.
class PassedReads {
 public:
  void note(const Symbol* of, PassedRead read) { reads_[of].push_back(std::move(read)); }
  // Declares that the Func's adjoint gets more than the contributions of its consumers.
  void close(const Symbol* of) { closed_.insert(of); }
  // The noted reads of the symbol; empty if it is closed.
  const std::vector<PassedRead>& of(const Symbol* symbol) const;

 private:
  std::unordered_map<const Symbol*, std::vector<PassedRead>> reads_;
  std::unordered_set<const Symbol*> closed_;
};

}  // namespace retrograde::autodiff
