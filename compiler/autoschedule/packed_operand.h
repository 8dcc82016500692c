// packed_operand.h -- what a tile of sums reads across the rows of its source, copied to where it lies
// together.
//
//   mixed(x, y, c) += weight(k, c) * inner(x, y, k)
//
// A tile of mixed reads a piece of each of 64 planes of inner: pieces that lie a power of two apart,
// often, and then in one set of the cache, for each tile of c again. The copy holds the pieces of
// all k for the x of the tile, is made once for all c, and fits in the nearest cache. Where vectors
// run across the rows, as in  product(j, i) += key(k, j) * query(k, i),  the copy is transposed.
// What is computed inline is computed once an element of the copy. Where a piece of all k is too large,
// it is of a block of them: all tiles of c add up the terms of one block before the next is copied.
//
// If the tiles that move the piece are too few parallel tasks and lanes run across rows, as in
// frame(k, t) += signal(hop * t + r) * filter(r, k)  for 128 filters, all of the operand is transposed once, before the
// loops of the sum, whose tasks are tiles of t.
// Source: K. Goto and R. van de Geijn, Anatomy of High-Performance Matrix Multiplication, ACM TOMS 34
// (2008), sections 4 and 5; theirs packs operands of matrix products, this what any linear index
// reads, of Funcs and of images.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autoschedule/register_tile.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"

namespace retrograde::autoschedule {

struct PackedOperand {
  FuncPtr source;  // or:
  std::shared_ptr<graph::ParameterContents> image;
  size_t lane_dimension = 0;     // of the source: the next lane reads the next along it
  std::vector<bool> depends_on;  // by dimension of the Func: what moves the piece
  struct Block {
    std::string loop;  // of the reduction, its outermost
    int64_t iterations;
  };
  std::optional<Block> block;  // that a copy is of; nullopt: all of the reduction
  // Tiles next to each other read much of the same along it, as rows of a stencil do: one copy
  // serves so many of them.
  struct Rows {
    size_t dimension;
    int64_t count;
  };
  std::optional<Rows> rows;
  bool is_whole = false;  // all that the sums read is copied once
};

// The operand of the update that is worth it, when the update has the tile; nullopt: none.
std::optional<PackedOperand> packed_operand(const FuncContents& f, const Definition& update,
                                            const RegisterTile& tile, int lanes,
                                            const SizeEstimate& sizes);
// What the call reads, to be copied at once with rows along the dimension of the source; nullopt: it cannot be copied.
std::optional<PackedOperand> whole_operand(const Call& call, const FuncContents& f,
                                           size_t lane_dimension);
// For each iteration of a loop of f, inside of which only dimensions run that do not move it.
void pack(const FuncPtr& f, const PackedOperand& operand, const retrograde::LoopLevel& loop,
          int lanes);
// All that f reads of it, before the loops of f.
void pack_whole(const FuncPtr& f, const PackedOperand& operand, int lanes);

}  // namespace retrograde::autoschedule
