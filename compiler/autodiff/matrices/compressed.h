// compressed.h -- evaluates the matrix of a linear pipeline in compressed form; the basis of jacobian.h.
//
// It finds the matrix's pattern, colours the columns, and evaluates the pipeline for all colours:
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
  FuncPtr output, seed;        // output and input of the linear pipeline
  Box rows, columns;           // relevant elements of the output and of the seed
  bool diagonal_only = false;  // only entries (x, x) are wanted; rows and columns have one shape
  bool symmetric = false;      // M equals its transpose
  int64_t most_colours = 0;    // 0: no limit
  unsigned long operations =
      isl_operations;  // isl budget for each part of the search for the pattern
};

class Compressed {
 public:
  // Returns null if more than `most_colours` are needed. Throws Unsupported if the pattern has no bounds, needs too
  // many colours, or takes too long to find.
  static std::unique_ptr<Compressed> make(const CompressionQuery& query);

  const Colours& colours() const { return colours_; }
  // Builds the Func `all` above, a new one in each call; null if M is zero.
  FuncPtr evaluate() const;
  // M(row, column), value k of a Tuple, where it may be nonzero. `all` comes from evaluate().
  Expr entry(const FuncPtr& all, const std::vector<Expr>& row, const std::vector<Expr>& column,
             int k) const;
  // Whether M(y, x) may be nonzero.
  Expr may_be_nonzero(const std::vector<Expr>& row, const std::vector<Expr>& column) const;
  // The least and largest x - y of entries for each dimension; nullopt if they are unbounded, or if rows and columns
  // differ in dimensions.
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
