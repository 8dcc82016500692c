// row_groups.h -- sums over the rows of a host join a loop over groups of these rows.
//
//   adj(x, y) = ...                                                    larger than caches
//   mean_adj(y) += adj(r, y)                                           a member (row_hosts.h)
//   in_adj(x, y) = adj(x, y) + mean_adj(y)                             the host
//   scale_adj_block(x, part, b) += adj(x, 128 part + 16 b + r) * in(x, 128 part + 16 b + r)        16 terms
//   scale_adj_parts(x, part) += scale_adj_block(x, part, r)            a guest, with 8 blocks
//
//   parallel y, for x: adj = ...                  parallel part, for b:
//   parallel y:                                     for 16 rows y, for x: adj = ...
//     mean_adj = ...                                for x: scale_adj_block = ...
//     for x: in_adj = ...                     =>    for 16 rows y:
//   parallel part, for x, for b:                      mean_adj = ...
//     scale_adj_block = ...                           for x: in_adj = ...
//     scale_adj_parts += scale_adj_block            for x: scale_adj_parts += scale_adj_block
//
// A group of rows comes from memory once. Each element of the sums has the same terms in the same order as before.
//
// 1. The private parts add up blocks, and the row of a block's term is a number whose digits are loops:
//    128 part + 16 b + r, with 16 values of r and 8 of b. Each loop is a digit of one coordinate of rows.
// 2. The lowest digits are loops of the block: its rows are a group. The others are variables of the parts and of their
//    sum, which become loops that host and guests share. Variables of the parts run in parallel, outside.
// 3. All guests of a host have the same groups. Rows are counted from 0.
// Not done: sums without blocks, which have few terms.
// Source: loop tiling and fusion; kernels of layer normalisation sum the gradients of scale and shift so by hand.
// Tests: test/autoschedule/row_guests_test.cpp.
#pragma once

#include <optional>
#include <vector>

#include "autoschedule/row_hosts.h"
#include "autoschedule/size_estimate.h"

namespace retrograde::autoschedule {

struct GuestOfGroups {
  RowGuest guest;
  std::vector<RowGroup> groups;
  size_t parallel = 0;  // of these, outermost first
};

// `place`: where the sums read the block. `rows`: of each read of what the host reads in its row, the index along each
// coordinate of rows, in variables of the block. nullopt: these are no groups that the host can share.
std::optional<GuestOfGroups> guest_of_groups(const RowHost& host, const FuncPtr& sums,
                                             const FuncPtr& block, const std::vector<Expr>& place,
                                             const std::vector<std::vector<Expr>>& rows,
                                             const SizeEstimate& sizes);

// The number of rows of a group.
int64_t rows_of_group(const RowHost& host, const std::vector<RowGroup>& groups,
                      const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
