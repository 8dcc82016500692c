// What the stages contribute to the adjoints of what they read: each read inverted, and kept until
// the adjoint is made of all that it gets.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "autodiff/inversion/read_inversions.h"
#include "autodiff/report/synthesis_account.h"
#include "autodiff/sweeps/passed_reads.h"
#include "autodiff/sweeps/primal.h"

namespace retrograde::autodiff {

class Contributions {
 public:
  Contributions(const Primal& primal, SynthesisAccount& account)
      : primal_(primal), account_(account) {}

  // values(args), one for each value of the symbol, inside of a box; undefined ones are zero.
  // `read`: elements that anybody looks at; may be empty (unknown).
  void add_pointwise(const Symbol* symbol, const std::vector<std::string>& args, const Box& box,
                     const std::vector<LoopVariable>& read, const std::vector<Expr>& values);
  // Of a stage of f to what the leaf reads. `adjoint`: that of the leaf, in other words.
  void add(const FuncPtr& f, const LeafAdjoint& leaf, const Expr& adjoint,
           const IterationDomain& domain);
  void add(const FuncPtr& f, const LeafAdjoint& leaf, const IterationDomain& domain) {
    add(f, leaf, leaf.adjoint, domain);
  }
  // Whether the readers of a Func that only looks another one up have contributed to that one
  // themselves. The Func keeps its own adjoint, for who asks for it.
  bool pass_on(const FuncContents& f);
  // All that the symbol's adjoint gets.
  std::vector<Contribution> take(const Symbol* symbol);

 private:
  const Inversion& inversion_of(const FuncContents& reader, const LeafAdjoint& leaf,
                                const IterationDomain& domain);

  const Primal& primal_;
  SynthesisAccount& account_;
  std::unordered_map<const Symbol*, std::vector<Contribution>> pending_;
  ReadInversions inversions_;
  PassedReads passed_;
};

}  // namespace retrograde::autodiff
