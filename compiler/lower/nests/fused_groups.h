// fused_groups -- find the stages that share loops (compute_with), and the order in which they run.
//
//   g.compute_with(f, y), h.compute_with(g, x)         f, g and h are one group, computed together:
//                                                 =>   for y { for x { f }, for x { g, h } }
//
// Method: the stages that share loops form a tree whose root is the stage that owns the loops; each node has the number
// of loops that it shares. The trees of a group run one after another, in an order that keeps the stages of every Func
// in order. A group is then sorted like a single Func. Linear in the number of Funcs and their calls.
// Errors: the conditions that docs/scheduling.md and Stage::compute_with state.
// Tests: test/unit/lower/compute_with_test.cpp, test/error/compute_with_errors_test.cpp.
#pragma once

#include <vector>

#include "lower/program.h"

namespace retrograde::lower {

struct FusedStage {
  int func = 0;  // in Program::funcs
  int stage = 0;
  // Indices into FusedNest::stages; -1 for the first stage. `joins`: the stage that owns the loops it runs in, the
  // `depth` outermost ones. `aligned_to`: the stage that compute_with named, which may itself run in other loops.
  int joins = -1, aligned_to = -1;
  int depth = 0;
  std::vector<LoopAlignStrategy> align;  // of the shared loops, outermost first
};

// The stage that owns the loops comes first; each other stage comes after the one that it joins.
struct FusedNest {
  std::vector<FusedStage> stages;
};

struct FusedGroup {
  std::vector<int> funcs;  // in Program::funcs
  std::vector<FusedNest> nests;
};

// CompileError for stages that cannot share loops. Otherwise makes the Funcs of each group adjacent; producers still
// come before consumers.
void order_fused_groups(Program& program);

// The groups of an ordered program: every Func is in exactly one group, usually alone.
std::vector<FusedGroup> fused_groups(const Program& program);

// The group without the Funcs that are not `kept`. Stages that joined the loops of a removed Func get their own loops.
FusedGroup part_of(const FusedGroup& group, const std::vector<int>& kept);

}  // namespace retrograde::lower
