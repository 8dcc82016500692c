// fused_groups -- which stages share loops (compute_with), and in what order a group's stages run.
//
//   g.compute_with(f, y), h.compute_with(g, x)         f, g and h are one group, computed together:
//                                                 =>   for y { for x { f }, for x { g, h } }
//
// Method: stages that share loops form a tree under the stage whose loops they are, each with the
// number of loops that it shares. The trees of a group run one after another, in an order that
// keeps the order of every Func's own stages. What is shared is sorted like one Func. Linear in the
// number of Funcs and their calls.
// Errors: what docs/scheduling.md and Stage::compute_with say of stages that can't share loops.
// Tests: test/unit/compute_with_test.cpp, test/error/compute_with_errors_test.cpp.
#pragma once

#include <vector>

#include "lower/program.h"

namespace retrograde::lower {

struct FusedStage {
  int func = 0;  // in Program::funcs
  int stage = 0;
  // In FusedNest::stages; -1 in the first. `joins`: in whose loops it runs, `depth` of them from
  // the outermost inwards. `aligned_to`: what compute_with named, which may itself have joined
  // other loops.
  int joins = -1, aligned_to = -1;
  int depth = 0;
  std::vector<LoopAlignStrategy> align;  // of the shared loops, outermost first
};

// The stage whose loops they are comes first, and each after the one that it joins.
struct FusedNest {
  std::vector<FusedStage> stages;
};

struct FusedGroup {
  std::vector<int> funcs;  // in Program::funcs
  std::vector<FusedNest> nests;
};

// CompileError for stages that cannot share loops; else the Funcs of each group come to lie beside
// each other, producers still before consumers.
void order_fused_groups(Program& program);

// Of an ordered program: every Func is in exactly one of the groups, most of them alone.
std::vector<FusedGroup> fused_groups(const Program& program);

// The group without the Funcs that are not `kept`. What joined the loops of one of these runs
// alone.
FusedGroup part_of(const FusedGroup& group, const std::vector<int>& kept);

}  // namespace retrograde::lower
