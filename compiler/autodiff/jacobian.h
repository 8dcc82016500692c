// jacobian.h -- whole Jacobians and Hessians that are sparse or small, at the cost of a few products.
//
// Jacobian j = jacobian(blur, image, {{0, 64}});   // d blur(y) / d image(x), y in [0, 64)
// j.colours();                                     // 3 for a stencil of three points, of any size
// j.dense()(y, x);  j.band()(y, k);                // as Funcs
//
// Elements that share no output element share a seed (colouring.h). One product is evaluated for each colour, all in
// one pipeline with one more dimension. The sparsity pattern is proven from the definitions (dependence.h): entries
// outside of it are zero, and all others are read directly off the products, without subtractions. Data-dependent
// indices and full reductions give dense parts, which take one colour for each element.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "autodiff/derivative.h"

namespace retrograde {

namespace autodiff {
struct JacobianResult;
}

// Which products are evaluated: Columns uses tangents, with one seed for each element of the input; Rows uses adjoints,
// with one for each element of the output. Auto takes the one with fewer colours, and Columns at a tie.
enum class Compression { Auto, Columns, Rows };

struct JacobianOptions {
  Compression compression = Compression::Auto;
  Overwritten overwritten = Overwritten::Store;
};

class Jacobian {
 public:
  explicit Jacobian(std::shared_ptr<const autodiff::JacobianResult> result);

  // The number of products that are evaluated.
  int colours() const;
  bool by_rows() const;
  // The colour of an element of the input (of the output if by_rows), int32 in [0, colours()).
  // Requires: an element has a coordinate in each dimension.
  Expr colour(const std::vector<Expr>& element) const;
  // All products: the dimensions of the output (of the input if by_rows), then the colour. Schedule this Func; the
  // others read it.
  Func compressed() const;
  // Dimensions of the output, then those of the input: the derivative of output(y...) by input(x...).
  Func dense() const;
  // Dimensions of the output, then one offset for each: band()(y..., k...) is the derivative of output(y...) by input(y
  // + band_offsets().min + k ...).
  // Requires: a band is made of constant offsets between output and input.
  Func band() const;
  Region band_offsets() const;  // constant offsets of the entries that may be nonzero
  std::string explain() const;

 private:
  std::shared_ptr<const autodiff::JacobianResult> result_;
};

// The Jacobian of `output` over output_bounds (min and extent in each dimension) by an input. A Func of several values
// (a Tuple) has one more dimension here, the last, for the value:
//   jacobian(f, pair, ...).dense()(y..., x..., k)     d f(y) / d pair(x)[k]
//   hessian(loss, pair).dense()(i..., k, j..., l)     d2 loss / d pair(i)[k] d pair(j)[l]
// All requirements of propagate_tangents and propagate_adjoints apply.
// Requires: what to differentiate by must be defined; only floating-point values have derivatives;
// only floating-point values that are defined have derivatives; the output needs bounds in each of
// its dimensions; rows are compressed of an output of one value (Unsupported); which elements
// depend on which is found by a bounded search over index sets (Unsupported); at most 4096 seeds
// are evaluated together (Unsupported); elements that one element may depend on must lie within
// constant bounds (Unsupported); which element depends on which is read off definitions
// (Unsupported).
Jacobian jacobian(const Func& output, const AdjointInput& input, const Region& output_bounds,
                  const JacobianOptions& options = {});

// The second derivatives of a scalar: dense()(i..., j...) = d2 loss / d wrt(i) d wrt(j), as tangents of the adjoint.
// Throws the errors of jacobian and hessian_vector_product.
// Requires: the input is a float that the loss depends on.
Jacobian hessian(const Func& loss, const AdjointInput& wrt,
                 Overwritten overwritten = Overwritten::Store);
// An off-diagonal block: dense()(i..., j...) = d2 loss / d rows(i) d columns(j).
Jacobian hessian(const Func& loss, const AdjointInput& rows, const AdjointInput& columns,
                 Overwritten overwritten = Overwritten::Store);

// Only d2 loss / d wrt(i)^2, with the dimensions of wrt. It needs fewer colours, because only neighbours must differ.
struct HessianDiagonal {
  Func diagonal;
  int colours = 1;
  Func compressed;  // undefined if the diagonal is zero
};
HessianDiagonal hessian_diagonal(const Func& loss, const AdjointInput& wrt,
                                 Overwritten overwritten = Overwritten::Store);

}  // namespace retrograde
