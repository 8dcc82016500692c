// synthesis_account.h -- collects the facts of Derivative::explain() during synthesis.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "autodiff/report/explain.h"
#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

class SynthesisAccount {
 public:
  void add(Explanation::Kind kind, const std::string& subject, const std::string& detail);  // once
  void add(const std::vector<Explanation>& lines);
  // Reports an adjoint of `primal` over a region: how it accumulates and its size.
  void built(const AdjointFunc& adjoint, const std::string& primal,
             const std::vector<LoopVariable>& region);

  std::vector<Explanation> take() { return std::move(lines_); }

 private:
  std::vector<Explanation> lines_;
};

}  // namespace retrograde::autodiff
