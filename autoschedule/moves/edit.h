// edit.h -- the vocabulary in which moves are written: questions about loops, changes of a nest, changes of a plan.
#pragma once

#include <optional>
#include <vector>

#include "autoschedule/access/cover.h"
#include "autoschedule/moves/move.h"

namespace retrograde::planning::moves {

// ---- questions ----

// Whether the plan expresses the Func, all of its loops run on the processor, and each is a step of one iterator that
// stands outside of smaller steps (L8).
bool is_editable(const Plan& plan, FuncId func);
// The same, but loops of a device may change where the program is for one.
bool is_editable(const Plan& plan, FuncId func, const Context& context);
// Whether it is also computed somewhere, so that it has loops.
bool has_loops(const Plan& plan, FuncId func);
// Whether iterations of a loop over the iterator may run in any order, and concurrently (L1, L6): they access different
// elements, those of pure variables always.
bool is_free(const Context& context, StageId stage, int iterator);
// The same for iterations of one loop of a nest, which agree in the iterators whose loops are all around it.
bool may_run_at_once(const Context& context, StageId stage, const Nest& nest, size_t depth);
// The stages that read the Func, also through inlined Funcs; those of inlined Funcs, too.
std::vector<StageId> all_readers(const Plan& plan, const Context& context, FuncId func);
// The stage with loops that alone reads the Func, perhaps through inlined ones; nullopt: there are more, or none.
std::optional<StageId> only_reader(const Plan& plan, const Context& context, FuncId func);
// Visits what a stage reads, also through inlined Funcs, with the iterators of the stage that move each index.
using MovedIndices = std::vector<IteratorSet>;
void for_each_read(const Plan& plan, const Context& context, StageId stage,
                   ir::FunctionRef<void(const Access&, const MovedIndices&)> visit);
// Whether the region that is read of the Func is bounded (L3), also through inlined Funcs: data decide no index without a
// range.
bool has_bounded_region(const Plan& plan, const Context& context, FuncId func);
// Whether a Func may be computed in a loop of a stage that reads it (L3, L8).
bool may_run_in_loops(const Plan& plan, const Context& context, FuncId func);
// Whether iterations of an update that access one element run in the order of its definition (L1, L2).
bool keeps_order(const Context& context, StageId stage, const Nest& nest);
// Whether a Func is stored somewhere else than where it is computed, or in a window. Opaque ones may be, in a loop.
bool has_window(const FuncPlan& func);
// Whether each update writes the elements that its pure variables name, and reads no others of the Func.
bool stays_in_place(const Context& context, FuncId func);
// Whether no loop needs a dimension of constant extent (L4).
bool runs_at_any_size(const FuncPlan& plan, const Context& context, FuncId func);
bool is_reduction(const Context& context, StageId stage, int iterator);
// The depth of a loop; of the loop with step 1, which exists in plans.
std::optional<size_t> find_loop(const Nest& nest, int iterator, int64_t step);
size_t innermost_loop(const Nest& nest, int iterator);
// The next larger step of the same iterator; 0: there is none.
int64_t outer_step(const Nest& nest, int iterator, int64_t step);
std::optional<size_t> vector_loop(const Nest& nest);
// The outermost loops that stages share (L11).
size_t shared_loops(const Plan& plan, StageId stage);
// The first of the loops at the end that are unrolled or lanes: they make the body of the loops around them.
size_t body_depth(const Nest& nest);
// The points of each iterator that all loops of a stage run over: estimates, or of a Func that is computed in a loop its
// box there; of a window that is stored outside of that loop, what each iteration adds.
Cover loop_extents(const Plan& plan, const Context& context, StageId stage);
// The points of an iterator that run inside of a loop: all if no loop down to this one steps over it. Loops that are fused
// count as very long where no step says how long they are.
int64_t points_inside(const Cover& extents, const Nest& nest, int depth, int iterator);
// How often a loop runs for each iteration of the loops around it.
int64_t trips(const Cover& extents, const Nest& nest, size_t depth);
// Whether a step is all of so many points, or not more than half of them: others waste what lies beyond the end.
bool fits(int64_t step, int64_t points);
// Whether loops of two nests, in which no Func is placed, run over the points in the same order.
bool has_same_order(const Nest& a, const Nest& b, const Cover& extents);
// The bytes of an element that is accessed.
double bytes_of_element(const Context& context, const Access& access);
// Operations of the stage's definition and of what is inlined into it (L5): once, and in the code that its loops make,
// whose copies share what they have in common.
int64_t operations(const Plan& plan, const Context& context, StageId stage);
int64_t body_operations(const Plan& plan, const Context& context, StageId stage, const Nest& nest,
                        const Cover& extents);
// The lanes of a vector of the stage's values along a loop of this extent: a vector, or for a shorter loop the half or
// quarter of one. 1: the loop is too short.
int64_t lanes_for(const Plan& plan, StageId stage, int64_t extent);
// How many accesses have lanes along the iterator that lie together; those that need an access for each lane count against
// it.
int lanes_together(const Context& context, StageId stage, int iterator);

// ---- changes of a nest ----

// Adds a loop with this step before the loop at `depth`.
void insert_step(Nest& nest, int iterator, int64_t step, size_t depth,
                 ForType kind = ForType::Serial);
// Removes a loop; the loop of the next larger step runs over its points.
void drop_loop(Nest& nest, size_t depth);
// The nest without lanes and unrolled loops, and without the steps that made room for them; nullopt if lanes add up a
// sum, whose chains of additions would become longer. Unrolled loops of the reduction stay where they are.
std::optional<Nest> without_body(const Nest& nest, const Context& context, StageId stage);
// Runs so many points of the iterator inside of all other loops. Requires: no step is smaller, except 1.
void run_inside(Nest& nest, int iterator, int64_t points, ForType kind);
// The elements that are computed in all iterations of the level's stage if its loop needs a box of these extents each time.
double computed_elements(const Plan& plan, const Context& context, const Level& level,
                         const std::vector<int64_t>& box);
double product_of(const std::vector<int64_t>& extents);
// The Func in a loop, with loops of its own as before, none of them parallel.
FuncPlan moved_inside(FuncPlan plan, const Placement& placement);
// Loops for all stages of a changed Func of the plan, whose dimensions have these extents, along rows as they are stored:
// lanes of the first dimension inside, then the reduction, then the other dimensions; in parallel at root, or as kernels of
// a device. `min_lanes`: fewer aren't used.
void run_along_rows(FuncPlan& changed, const Plan& plan, const Context& context, FuncId func,
                    const Cover& extents, int64_t min_lanes);
bool is_kernel(const Nest& nest);
// Whether a kernel can compute the stage, with what is inlined into it: it calls nothing of the host.
bool may_be_kernel(const Plan& plan, const Context& context, StageId stage);
// The threads of a block: so many along the first iterator, and the others along those that follow in memory.
struct KernelShape {
  int64_t along_first = 0;
  int16_t first = -1;  // -1: the one whose elements lie together
};
// A grid over the iterators whose iterations may run at once, with serial loops inside of its threads; one thread if there is
// none. Updates that may meet are atomic where their order changes no bit, or may.
Nest kernel_loops(const Plan& plan, const Context& context, StageId stage,
                  const std::vector<int16_t>& order, const KernelShape& shape);
// Makes a dimension the innermost one in memory.
void store_first(Storage& storage, int dimension);
// Makes the outermost loops of a stage at root parallel until there are enough chunks of work for the threads, inside of
// those that have to be serial; none for one thread. The innermost loop is in chunks.
void run_in_parallel(Nest& nest, const Context& context, StageId stage);

// ---- changes of a plan ----

// The plan in which the Func runs like this; nullopt if it's no other plan or not a legal one: a loop is gone in which
// something is placed, its region changes though it needs constant extents (L4), a window changes (L9), loops that
// stages share differ (L11), or iterations of an update that access one element change their order (L1, L2), unless any
// order is asked for.
enum class Terms : uint8_t { InOrder, InAnyOrder };
std::optional<Plan> with_func(const Plan& plan, FuncId func, FuncPlan changed,
                              const Context& context, Terms terms = Terms::InOrder);
// The loops of a stage of a plan.
struct StageLoops {
  const Plan& plan;
  const Context& context;
  const StageId stage;
  const Nest& nest;
  const Cover extents;  // loop_extents
};
// The legal plans in which one stage of the Func has one of these nests instead.
std::vector<Plan> with_nests(const Plan& plan, FuncId func, const Context& context,
                             std::vector<Nest> (*nests)(const StageLoops&),
                             Terms terms = Terms::InOrder);
// The plan in which a loop takes another step, in all stages that share it. What is computed in it follows; nullopt: a box
// changes that needs constant extents (L4), or a row of a window does (L9). Requires: the loop is one of pure iterators.
std::optional<Plan> with_step(const Plan& plan, const LoopRef& loop, int64_t step,
                              const Context& context);
// The plan in which a loop with this step stands around another one, in all stages that share it; what is computed in that
// stays there. Requires: the step is larger.
std::optional<Plan> with_strips(const Plan& plan, const LoopRef& rows, int64_t step);
// The elements in memory from lane to lane of a vector along the iterator, in the storage of the Func that is read or, if it
// can be stored otherwise, in the best one; 0: no such number.
int64_t lane_stride(const Plan& plan, const Context& context, const Access& read, int iterator);
// The plan in which a dimension of the Func is innermost in memory and all stages have lanes along it; so do Funcs that
// read it at their own places. nullopt: it isn't a legal one. Outputs keep their layout.
std::optional<Plan> with_turned_results(const Plan& plan, FuncId func, int dimension,
                                        const Context& context);
// The plan in which the lanes of the stage read neighbours in memory, of Funcs that can be stored so; nullopt: they do, or
// none can.
std::optional<Plan> with_turned_operands(const Plan& plan, StageId stage, const Context& context);
// Adds a plan that isn't in the list yet.
void add(std::vector<Plan>& plans, std::optional<Plan> plan);
// Adds the plans in which the Func is computed at this place in loops of others, where this box of it is needed: with its
// own loops, and along rows.
void add_placed(std::vector<Plan>& plans, const Plan& plan, FuncId func, const Placement& placement,
                const std::vector<int64_t>& box, const Context& context);

}  // namespace retrograde::planning::moves
