// contributions.h -- collects the contributions to each adjoint until the adjoint is built.
//
// Each read of a stage contributes to the adjoint of the Func or image that it reads. The access is inverted here.
#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "autodiff/borders/passed_reads.h"
#include "autodiff/inversion/read_inversions.h"
#include "autodiff/report/synthesis_account.h"
#include "autodiff/sweeps/primal.h"

namespace retrograde::autodiff {

class Contributions {
 public:
  Contributions(const Primal& primal, SynthesisAccount& account)
      : primal_(primal), account_(account) {}

  // Adds values(args) inside of a box, one for each value of the symbol; undefined ones are zero. `read` is the region
  // that consumers read; empty if unknown.
  void add_pointwise(const Symbol* symbol, const std::vector<std::string>& args, const Box& box,
                     const std::vector<LoopVariable>& read, const std::vector<Expr>& values);
  // Adds the contribution of a stage of f to the symbol that the leaf reads. `adjoint` replaces the leaf's own adjoint.
  // If consumers read a pure Func at indices without bounds, its adjoint has no size: f contributes to what that Func
  // reads instead.
  void add(const FuncPtr& f, const LeafAdjoint& leaf, const Expr& adjoint,
           const IterationDomain& domain);
  void add(const FuncPtr& f, const LeafAdjoint& leaf, const IterationDomain& domain) {
    add(f, leaf, leaf.adjoint, domain);
  }
  // For a Func that only looks another one up: whether its consumers have contributed to that other Func themselves.
  // The Func still has its own adjoint, in case it was requested.
  bool pass_on(const FuncContents& f);
  // Returns and removes all contributions to the symbol.
  std::vector<Contribution> take(const Symbol* symbol);
  // The Funcs without an adjoint of their own, because their consumers contribute to what they read.
  const std::unordered_set<const Symbol*>& without_adjoint() const { return without_adjoint_; }

 private:
  bool has_size(const FuncContents& f) const;
  void add_to_what_it_reads(const FuncContents& read, const FuncPtr& f, const LeafAdjoint& leaf,
                            const IterationDomain& domain);
  InvertedRead inverted(const FuncContents& reader, const LeafAdjoint& leaf,
                        const IterationDomain& domain);

  const Primal& primal_;
  SynthesisAccount& account_;
  std::unordered_map<const Symbol*, std::vector<Contribution>> pending_;
  ReadInversions inversions_;
  PassedReads passed_;
  std::unordered_set<const Symbol*> without_adjoint_;
};

}  // namespace retrograde::autodiff
