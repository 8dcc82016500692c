// start_in_tiles -- sums start where their tiles are added up, not in a pass of their own.
//
//   f = 0 over all, then f += ... tile by tile   =>   for each tile: f = 0, f += ...
//
// The pass would write all of f to memory and the tiles read it again: of a sum of few terms, as of
// a convolution's, that is a good part of its time. The same holds for scans along rows (row_scans.h), whose tiles are
// blocks of whole rows.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::autoschedule {

// A loop over a dimension, over its parts, or over one of these.
struct TileLoop {
  Dim loop;
  std::string dimension;
  const Split* split;  // of the dimension; null: none
};
// Of a stage, the outermost first, up to the first that is none.
std::vector<TileLoop> tile_loops(const FuncContents& f, const Definition& stage);

// The split of a loop over a row of the tile into vectors and phases (phase_loops.h); null: there is none.
const Split* split_of_phases(const Definition& stage, const std::string& row);

// Whether the first update of f has loops over tiles of the result outside of those of its
// reduction, so that what comes before can share them.
bool has_tiles(const FuncContents& f);

// Gives the pure stage, which has no directives, the loops over tiles of the first update, and puts
// that into them. `lanes`: of the vectors.
void start_in_tiles(const FuncPtr& f, int lanes);

}  // namespace retrograde::autoschedule
