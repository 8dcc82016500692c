// colour_table -- colours of an explicit pattern (graph_colouring.h), as tables that pipelines
// read.
#pragma once

#include <isl/cpp.h>

#include <optional>
#include <vector>

#include "autodiff/matrices/colouring.h"
#include "frontend/data/buffer.h"

namespace retrograde::autodiff {

struct ColourTable {
  Buffer<int> colours;  // over a box around the columns
  Buffer<int> alone;    // symmetric: 1 where (row, colour) is a single entry; else undefined
  int64_t count = 1;
  Expr of(const std::vector<Expr>& column) const;  // in [0, count), for any place
  Expr is_alone(const std::vector<Expr>& row, const Expr& colour) const;
};

// Of a pattern with constant bounds and few entries, when it takes fewer than `fewer_than` colours.
// `symmetric`: a star colouring, for matrices that equal their transpose; else of the columns.
std::optional<ColourTable> colour_table(const isl::map& pattern, bool symmetric,
                                        int64_t fewer_than);

// Either way of colouring.
struct Colours {
  Colouring linear;
  std::optional<ColourTable> table;
  int64_t count() const { return table ? table->count : linear.count; }
  Expr of(const std::vector<Expr>& column) const {
    return table ? table->of(column) : linear.of(column);
  }
};

}  // namespace retrograde::autodiff
