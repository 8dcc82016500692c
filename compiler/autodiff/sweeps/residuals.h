// residuals.h -- find the sums of a forward pass that its gradient reads again, and read them from images instead.
//
//   largest(y) = max of in(x, y)                     forward pass: out, and as further outputs largest and total
//   total(y) = sum of exp(in(x, y) - largest(y))  =>
//   out(y) = largest(y) + log(total(y))              backward pass: in_adj, from images of largest and total
//
// A framework such as PyTorch runs a forward pass and its gradient in two calls. The gradient then computes every value
// of the forward pass that it reads once more, unless it was handed over. A residual is such a value: handed over it
// costs a memory round trip, recomputed it costs a pass over all of its terms.
//
// Method: walk from the gradients towards the inputs, down to the first Funcs of the forward pass that reduce many terms
// to each element. What only these Funcs read is no part of the gradient any more.
// Not handed over: Tuples; large Funcs, which may share tiles with their consumers in the forward pass; Funcs whose
// regions are not constant, do not start at 0, or are larger in the backward pass; anything if the program has
// directives, because these may name Funcs that would be gone.
// Tests: test/gradient/residuals_test.cpp, test/python/torch_residuals_test.py.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

struct Residual {
  FuncPtr func;
  std::vector<int64_t>
      extents;  // of the region that the forward pass computes, from 0; dimension 0 first
};

// The residuals of a forward pass for its gradients, none of which is one of its outputs. The sizes of outputs and
// gradients are those of their buffers, or their estimates.
std::vector<Residual> residuals_of(const std::vector<FuncPtr>& outputs,
                                   const std::vector<FuncPtr>& gradients);

// Whether there are residuals for some gradient. Takes much less time than differentiation.
bool may_have_residuals(const std::vector<FuncPtr>& outputs);

// Copies of the gradients in which each residual is read from the image at its position.
std::vector<FuncPtr> reading_residuals(
    const std::vector<FuncPtr>& gradients, const std::vector<FuncPtr>& residuals,
    const std::vector<std::shared_ptr<graph::ParameterContents>>& images);

}  // namespace retrograde::autodiff
