// jacobian.h -- whole Jacobians and Hessians that are sparse or small, from few pipelines' worth of
// work.
//
// Jacobian j = jacobian(blur, image, {{0, 64}});   // d blur(y) / d image(x), y in [0, 64)
// j.colours();                                     // 3 for a stencil of three points, of any size
// j.dense()(y, x);  j.band()(y, k);                // as Funcs
//
// Elements that no output element has in common share a seed (colouring.h), so as many products are
// evaluated as there are colours, in one pipeline with one more dimension. The pattern is proven
// from the definitions (dependence.h): entries that it leaves out are zero, and all others are
// read off the products directly, without subtractions. Data-dependent places and reductions over
// everything make dense parts, which cost a colour an element.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "autodiff/derivative.h"

namespace retrograde {

namespace autodiff {
struct JacobianResult;
}

// Which sums are evaluated: over columns (tangents, one seed an element of the input) or over rows
// (adjoints, one an element of the output). Auto: the one with fewer colours, Columns at a tie.
enum class Compression { Auto, Columns, Rows };

struct JacobianOptions {
  Compression compression = Compression::Auto;
  Overwritten overwritten = Overwritten::Store;
};

class Jacobian {
 public:
  explicit Jacobian(std::shared_ptr<const autodiff::JacobianResult> result);

  // How many products are evaluated.
  int colours() const;
  bool by_rows() const;
  // The colour of an element of the input (of the output when by_rows), int32 in [0, colours()).
  // Requires: an element has a coordinate in each dimension.
  Expr colour(const std::vector<Expr>& element) const;
  // All products: the dimensions of the output (the input when by_rows), then the colour. Schedule
  // this one; what follows reads it.
  Func compressed() const;
  // Dimensions of the output, then those of the input: the derivative of output(y...) by
  // input(x...).
  Func dense() const;
  // Dimensions of the output, then an offset for each: band()(y..., k...) is the derivative of
  // output(y...) by input(y + band_offsets().min + k ...).
  // Requires: a band is made of constant offsets between output and input.
  Func band() const;
  Region band_offsets() const;  // of entries that may be nonzero: constants
  std::string explain() const;

 private:
  std::shared_ptr<const autodiff::JacobianResult> result_;
};

// Of `output` over output_bounds (min and extent in each dimension) by an input. One of several
// values (a Func of Tuples) has one more dimension here, the value, last:
//   jacobian(f, pair, ...).dense()(y..., x..., k)     d f(y) / d pair(x)[k]
//   hessian(loss, pair).dense()(i..., k, j..., l)     d2 loss / d pair(i)[k] d pair(j)[l]
// What propagate_tangents and propagate_adjoints require, it requires.
// Requires: what to differentiate by must be defined; only floating-point values have derivatives;
// only floating-point values that are defined have derivatives; the output needs bounds in each of
// its dimensions; rows are compressed of an output of one value (Unsupported); which elements
// depend on which is found by a bounded search over index sets (Unsupported); at most 4096 seeds
// are evaluated together (Unsupported); elements that one element may depend on must lie within
// constant bounds (Unsupported); which element depends on which is read off definitions
// (Unsupported).
Jacobian jacobian(const Func& output, const AdjointInput& input, const Region& output_bounds,
                  const JacobianOptions& options = {});

// The second derivatives of a scalar: dense()(i..., j...) = d2 loss / d wrt(i) d wrt(j). Tangents
// of the adjoint. Errors as jacobian and hessian_vector_product.
// Requires: the input is a float that the loss depends on.
Jacobian hessian(const Func& loss, const AdjointInput& wrt,
                 Overwritten overwritten = Overwritten::Store);
// A block off the diagonal: dense()(i..., j...) = d2 loss / d rows(i) d columns(j).
Jacobian hessian(const Func& loss, const AdjointInput& rows, const AdjointInput& columns,
                 Overwritten overwritten = Overwritten::Store);

// d2 loss / d wrt(i)^2 alone, with the dimensions of wrt: fewer colours, as only neighbours must
// differ.
struct HessianDiagonal {
  Func diagonal;
  int colours = 1;
  Func compressed;  // undefined when the diagonal is zero
};
HessianDiagonal hessian_diagonal(const Func& loss, const AdjointInput& wrt,
                                 Overwritten overwritten = Overwritten::Store);

}  // namespace retrograde
