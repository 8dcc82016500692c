// compressed -- the pattern of a linear pipeline's matrix, colours for its columns, and the
// pipeline evaluated for all colours: what jacobian.h is made of.
//
//   out(y) = sum_x M(y, x) seed(x)      =>      all(y, c) = sum of M(y, x) over x of colour c
#pragma once

#include <memory>
#include <optional>

#include "autodiff/inversion/isl_points.h"
#include "autodiff/matrices/colour_table.h"
#include "autodiff/matrices/dependence.h"
#include "graph/function.h"

namespace retrograde::autodiff {

struct CompressionQuery {
  FuncPtr output, seed;        // of the linear pipeline
  Box rows, columns;           // elements of the output and of the seed that count
  bool diagonal_only = false;  // entries (x, x) alone are wanted; rows and columns have one shape
  bool symmetric = false;      // M equals its transpose
  int64_t most_colours = 0;    // 0: any number
  unsigned long operations = isl_operations;  // of isl, in a part of the search for the pattern
};

class Compressed {
 public:
  // Null when more than `most_colours` are needed. Unsupported where the pattern has no bounds,
  // needs too many colours, or takes too long to find.
  static std::unique_ptr<Compressed> make(const CompressionQuery& query);

  const Colours& colours() const { return colours_; }
  // The Func `all` above, made at each call; null: M is zero.
  FuncPtr evaluate() const;
  // M(row, column), with `all` from evaluate(), where it may be nonzero; value k of a Tuple.
  Expr entry(const FuncPtr& all, const std::vector<Expr>& row, const std::vector<Expr>& column,
             int k) const;
  // Whether M(y, x) may be other than 0.
  Expr may_be_nonzero(const std::vector<Expr>& row, const std::vector<Expr>& column) const;
  // Least and largest x - y of entries, one a dimension; nullopt where they have no bounds, or rows
  // and columns differ in dimensions.
  std::optional<std::vector<ConstantRange>> offsets() const;

 private:
  explicit Compressed(const CompressionQuery& query);
  std::optional<Colours> colour() const;
  std::optional<Colouring> linear_colours(const isl::set& differences, int64_t most) const;
  template <class Search>
  auto searched(const Search& search) const;
  Expr seed_value(const std::vector<Expr>& column, const Expr& colour) const;
  CompressionQuery query_;
  std::unique_ptr<Dependence> dependence_;
  isl::map pattern_;
  Colours colours_;
};

}  // namespace retrograde::autodiff
