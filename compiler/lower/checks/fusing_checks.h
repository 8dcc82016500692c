// fusing_checks.h -- collects compute_with directives, and rejects stages that cannot share loops.
#pragma once

#include <vector>

#include "lower/nests/fused_groups.h"

namespace retrograde::lower {

// One compute_with: a stage runs in the `depth` outermost loops of another.
struct Joining {
  int func = 0, stage = 0, with = 0, with_stage = 0;
  int depth = 0;
  std::vector<LoopAlignStrategy> align;  // outermost first
};

// The compute_with directives of a program that has passed check_joinings.
std::vector<Joining> joinings_of(const Program& program);

// CompileError unless, for each compute_with: 1. the other stage is part of the pipeline, and named exactly if its Func
// has several stages; 2. both are computed by loops at the same place; 3. the loops down to the level have the same
// names and kinds; 4. neither Func is memoized or async, and no prefetch is at a shared loop of the stage that joins;
// 5. no stage joins itself through others; 6. an update that joins the stage before it accesses, in each
// iteration, only elements that the stage computed in that iteration (own_joining.h).
void check_joinings(const Program& program);

// 7. No Func of a group depends on another one of the group.
void check_group(const Program& program, const FusedGroup& group);

// The following functions always throw.
// 8. Stages of one Func run in their order. `stages`: of a nest that would have to wait for itself.
[[noreturn]] void check_order_of_stages(const Program& program,
                                        const std::vector<FusedStage>& stages);
// 9. Groups do not depend on each other cyclically. `path`: groups of which each depends on the next; the last one
// depends on `again`, which is in the path.
[[noreturn]] void check_groups_have_order(const Program& program,
                                          const std::vector<FusedGroup>& groups,
                                          const std::vector<int>& path, int again);

// Funcs that the definitions of f call, in first-use order.
std::vector<int> callees_of(const Program& program, int f);

}  // namespace retrograde::lower
