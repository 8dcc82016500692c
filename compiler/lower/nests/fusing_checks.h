// fusing_checks.h -- what compute_with asks for, and when stages cannot share loops.
#pragma once

#include <vector>

#include "lower/nests/fused_groups.h"

namespace retrograde::lower {

// One compute_with: a stage runs in `depth` outermost loops of another.
struct Joining {
  int func = 0, stage = 0, with = 0, with_stage = 0;
  int depth = 0;
  std::vector<LoopAlignStrategy> align;  // outermost first
};

// Of a program that check_joinings let pass.
std::vector<Joining> joinings_of(const Program& program);

// CompileError unless, for each compute_with: 1. the other stage is part of the pipeline, and known
// if its Func has several; 2. both are computed, at the same place, by loops; 3. the loops down to
// the level have the same names and kinds; 4. neither Func is memoized or asynchronous, and nothing
// is prefetched at a shared loop of the stage that joins; 5. no stage joins itself by way of
// others; 6. an update that joins the stage before it touches in each iteration what that has made
// there (own_joining.h).
void check_joinings(const Program& program);

// 7. No Func of a group needs another one of it.
void check_group(const Program& program, const FusedGroup& group);

// What follows throws.
// 8. Stages of one Func run in their order. `stages`: of a nest that has to wait for itself.
[[noreturn]] void check_order_of_stages(const Program& program,
                                        const std::vector<FusedStage>& stages);
// 9. Groups do not need each other. `path`: groups, each of which needs the next, and the last
// needs `again`, which is one of them.
[[noreturn]] void check_groups_have_order(const Program& program,
                                          const std::vector<FusedGroup>& groups,
                                          const std::vector<int>& path, int again);

// Funcs that the definitions of f call, in first-use order.
std::vector<int> callees_of(const Program& program, int f);

}  // namespace retrograde::lower
