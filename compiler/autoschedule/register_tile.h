// register_tile.h -- how much of a reduction's result is computed at once, in registers.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "autoschedule/machine/machine.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of a stage  f(x, ..., c, ...) = f(x, ..., c, ...) op e  over a reduction domain: so many vectors
// of the first dimension, and so many values of others, whose sums are kept while the reduction
// runs, so that what is loaded is used several times.
struct RegisterTile {
  int64_t vectors = 1;
  struct Side {
    size_t dimension;
    int64_t size;
  };
  std::vector<Side> sides;
  // Phases of a stride along the first dimension (phase_loops.h): each has that many vectors.
  int64_t phases = 1;
  // Elements along a dimension, of vectors of so many lanes along the first.
  int64_t size_along(size_t dimension, int lanes) const;
};

// The tile with the fewest cycles for each product; nullopt: none is better than one vector, or the
// stage is no such update. `lanes` in a vector of the first dimension; `vectors`: how many of them
// the dimension has at most. Where sizes are known, the tile fits them: what of its registers lies
// beyond the end counts as lost.
// Model: two loads and two multiply-adds a cycle, of which each sum takes one every four cycles; a
// vector, whose place is any, counts as two loads (vector units of x86-64 since 2015), the first of a
// row as four where each iteration reads another row. A vector of so many lanes is several registers
// where these are smaller, each loaded alone; what all lanes share is loaded once. A vector of every
// second element is picked from two. Functions in the terms take what they take, so that a tile which
// only hides latency is none. `phases`: of the tile.
std::optional<RegisterTile> register_tile(const FuncContents& f, const Definition& stage, int lanes,
                                          int64_t vectors, const planning::Machine& machine,
                                          const SizeEstimate& sizes = {}, int64_t phases = 1);

}  // namespace retrograde::autoschedule
