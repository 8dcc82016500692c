// What synthesis did and did not do, in words: the lines of Derivative::explain().
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "autodiff/report/explain.h"
#include "autodiff/sweeps/accumulation.h"

namespace retrograde::autodiff {

class SynthesisAccount {
 public:
  void add(Explanation::Kind kind, const std::string& subject, const std::string& detail);  // once
  void add(const std::vector<Explanation>& lines);
  // An adjoint of `primal` over a region: how it accumulates, where, how large it is.
  void built(const AdjointFunc& adjoint, const std::string& primal,
             const std::vector<LoopVariable>& region);

  std::vector<Explanation> take() { return std::move(lines_); }

 private:
  std::vector<Explanation> lines_;
};

}  // namespace retrograde::autodiff
