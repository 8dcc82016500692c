// colour_table.h -- colours of an explicit pattern (graph_colouring.h), as tables that pipelines read.
#pragma once

#include <isl/cpp.h>

#include <optional>
#include <vector>

#include "autodiff/matrices/colouring.h"
#include "frontend/data/buffer.h"

namespace retrograde::autodiff {

struct ColourTable {
  Buffer<int> colours;  // colour of each column, over a box around the columns
  Buffer<int> alone;    // symmetric only: 1 where (row, colour) is a single entry
  int64_t count = 1;
  Expr of(const std::vector<Expr>& column) const;  // in [0, count), also outside of the box
  Expr is_alone(const std::vector<Expr>& row, const Expr& colour) const;
};

// Colours a pattern with constant bounds and few entries; nullopt unless it takes fewer than `fewer_than` colours. With
// `symmetric` it is a star colouring, for matrices that equal their transpose; else a colouring of the columns.
std::optional<ColourTable> colour_table(const isl::map& pattern, bool symmetric,
                                        int64_t fewer_than);

// A colouring of either kind.
struct Colours {
  Colouring linear;
  std::optional<ColourTable> table;
  int64_t count() const { return table ? table->count : linear.count; }
  Expr of(const std::vector<Expr>& column) const {
    return table ? table->of(column) : linear.of(column);
  }
};

}  // namespace retrograde::autodiff
