// loop_directives.h -- directives that schedule the loops of one definition. Stage has these
// methods, and Func has them for its first definition.
//
// Directives change the order and the manner in which the points of a definition are computed,
// never the values. A stage starts with one loop for each variable: the reduction variables
// innermost, in their order, then the pure variables. Directives name loops by Var or RVar. They
// throw CompileError if a rule is broken.
#pragma once

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "frontend/language/var_or_rvar.h"
#include "frontend/schedule/loop_level.h"
#include "graph/definitions/inline_calls.h"
#include "graph/directives/give_directive.h"
#include "ir/target.h"

namespace retrograde {

class Func;
class Stage;

namespace frontend {

// Helpers of the methods below.
ReorderLoops reorder_of(const std::vector<VarOrRVar>& vars);
std::vector<VarOrRVar> loops_at(const SchedulePlace& place);
VarOrRVar fresh_like(const VarOrRVar& var);
retrograde::LoopLevel level_of(const Stage& stage, const VarOrRVar& var);
void check_tile(const SchedulePlace& place, const std::vector<VarOrRVar>& loops,
                const std::vector<size_t>& sizes);
PrefetchData prefetch_of(const SchedulePlace& place, const Func& f, PrefetchData prefetch);
PrefetchData prefetch_of(const SchedulePlace& place,
                         const std::shared_ptr<ParameterContents>& image, PrefetchData prefetch);
void check_device(const SchedulePlace& place, const std::vector<VarOrRVar>& loops,
                  DeviceAPI device);
// Checks how a loop would run before it is split, so that an illegal directive leaves the stage
// unchanged.
void check_run(const SchedulePlace& place, const VarOrRVar& loop, ForType kind);

}  // namespace frontend

// The loop directives of Stage and Func.
// Requires: a name must be a loop of this stage; the loops of a stage have different names; only
// what is computed somewhere has loops; a size has one value in each call: it is made of parameters
// and facts about buffers.
template <class Self>
class LoopDirectives {
 public:
  // ---- the shape of the loops ----

  // Splits a loop into an outer loop and an inner loop of `factor` iterations. split(x, xo, xi, f):
  //   for x in [0, n):        for xo in [0, ceil(n / f)):
  //     body(x)          =>     for xi in [0, f):
  //                               body(xo * f + xi)
  // The tail strategy decides what happens if f does not divide n; see TailStrategy. ShiftInwards
  // applies to first definitions only; a loop over a reduction variable takes GuardWithIf or
  // Predicate.
  // Requires: the factor must be a defined expression; a factor is an integer; a factor is at least
  // 1; a factor fits an int32; the two new loops have different names; a loop over a reduction
  // variable runs exactly over its domain; an update definition does not run a point twice.
  Self& split(const VarOrRVar& old, const VarOrRVar& outer, const VarOrRVar& inner,
              const Expr& factor, TailStrategy tail = TailStrategy::Auto) {
    return give(graph::SplitLoop{old.name(), outer.name(), inner.name(), factor, tail});
  }
  // Fuses two nested loops into one. fuse(x, y, t):
  //   for y in [0, m):           for t in [0, n * m):
  //     for x in [0, n):    =>     body(t % n, t / n)
  //       body(x, y)
  // The fused loop has the kind of the outer one. A pure loop and a reduction loop give a
  // reduction loop.
  // Requires: it takes two loops; iterations that run at the same time must not touch the same
  // element.
  Self& fuse(const VarOrRVar& inner, const VarOrRVar& outer, const VarOrRVar& fused) {
    return give(graph::FuseLoops{inner.name(), outer.name(), fused.name()});
  }
  // Renames a loop. rename(x, t):
  //   for x:          for t:
  //     body(x)   =>    body(t)
  Self& rename(const VarOrRVar& old_name, const VarOrRVar& new_name) {
    return give(graph::RenameLoop{old_name.name(), new_name.name()});
  }
  // Reorders loops, innermost first; loops that are not named keep their places. reorder(y, x):
  //   for y:            for x:
  //     for x:     =>     for y:
  //       body(x, y)        body(x, y)
  // Reduction loops are reordered among each other only if the results are known not to change.
  // Requires: each loop is named once; the order of reduction loops may change only where it
  // changes no result.
  Self& reorder(const std::vector<VarOrRVar>& vars) { return give(frontend::reorder_of(vars)); }
  template <std::convertible_to<VarOrRVar>... Rest>
  Self& reorder(const VarOrRVar& x, const VarOrRVar& y, Rest&&... rest) {
    return reorder(std::vector<VarOrRVar>{x, y, VarOrRVar(std::forward<Rest>(rest))...});
  }
  // Splits two loops and reorders them to run tile by tile. The loops are xi, yi, xo, yo,
  // innermost first.
  //   for y:                 for yo:
  //     for x:                 for xo:
  //       body(x, y)     =>      for yi:
  //                                for xi:
  //                                  body(xo * fx + xi, yo * fy + yi)
  Self& tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& xo, const VarOrRVar& yo,
             const VarOrRVar& xi, const VarOrRVar& yi, const Expr& xfactor, const Expr& yfactor,
             TailStrategy tail = TailStrategy::Auto) {
    split(x, xo, xi, xfactor, tail);
    split(y, yo, yi, yfactor, tail);
    return reorder(xi, yi, xo, yo);
  }
  Self& tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& xi, const VarOrRVar& yi,
             const Expr& xfactor, const Expr& yfactor, TailStrategy tail = TailStrategy::Auto) {
    return tile(x, y, x, y, xi, yi, xfactor, yfactor, tail);
  }
  // Requires: all lists have one length.
  Self& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
             const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
             const std::vector<TailStrategy>& tails) {
    frontend::check_tile(place(), previous,
                         {outers.size(), inners.size(), factors.size(), tails.size()});
    for (size_t i = 0; i < previous.size(); i++)
      split(previous[i], outers[i], inners[i], factors[i], tails[i]);
    std::vector<VarOrRVar> order = inners;
    order.insert(order.end(), outers.begin(), outers.end());
    return reorder(order);
  }
  Self& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
             const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
             TailStrategy tail = TailStrategy::Auto) {
    return tile(previous, outers, inners, factors,
                std::vector<TailStrategy>(previous.size(), tail));
  }
  Self& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& inners,
             const std::vector<Expr>& factors, TailStrategy tail = TailStrategy::Auto) {
    return tile(previous, previous, inners, factors, tail);
  }

  // ---- how a loop runs ----

  // Runs the iterations in order on one thread, as loops do by default.
  Self& serial(const VarOrRVar& var) { return give(graph::RunLoop{var.name(), ForType::Serial}); }
  // Distributes the iterations over threads.
  //   for y:          parallel for y:
  //     body(y)   =>    body(y)
  // A reduction loop can be parallel if its iterations are independent, the update is atomic(), or
  // race conditions are allowed.
  // Requires: iterations that run at the same time must not touch the same element; a parallel loop
  // is not inside of a vectorized one.
  Self& parallel(const VarOrRVar& var) {
    return give(graph::RunLoop{var.name(), ForType::Parallel});
  }
  // Computes all iterations at once, one per vector lane. The extent must be constant.
  //   for x in [0, 4):      body(ramp(0, 1, 4))
  //     body(x)         =>
  // Reduction loops follow the rule of parallel().
  // Requires: iterations that run at the same time must not touch the same element; the extent of a
  // vectorized loop must be a constant, or have a constant above it; vectors have at most 4096
  // lanes; loops around the calls of a C function are serial, parallel or unrolled.
  Self& vectorize(const VarOrRVar& var) {
    return give(graph::RunLoop{var.name(), ForType::Vectorized});
  }
  // Replaces the loop by one copy of the body for each iteration. The extent must be constant.
  //   for x in [0, 2):      body(0)
  //     body(x)         =>  body(1)
  // Requires: the extent of an unrolled loop must be a constant, or have a constant above it.
  Self& unroll(const VarOrRVar& var) { return give(graph::RunLoop{var.name(), ForType::Unrolled}); }
  // Splits a loop and runs the new outer loop in parallel. vectorize and unroll with a factor also
  // split, and apply to the new inner loop. The outer loop keeps the name of `var`.
  //   parallel(y, 4):            vectorize(x, 8), unroll(x, 8):
  //     parallel for y:            for x:
  //       for y' in [0, 4):          vectorized (unrolled) for x' in [0, 8):
  //         body(4 * y + y')           body(8 * x + x')
  Self& parallel(const VarOrRVar& var, const Expr& task_size,
                 TailStrategy tail = TailStrategy::Auto) {
    frontend::check_run(place(), var, ForType::Parallel);
    return split(var, var, frontend::fresh_like(var), task_size, tail).parallel(var);
  }
  Self& vectorize(const VarOrRVar& var, const Expr& factor,
                  TailStrategy tail = TailStrategy::Auto) {
    frontend::check_run(place(), var, ForType::Vectorized);
    const VarOrRVar lanes = frontend::fresh_like(var);
    return split(var, var, lanes, factor, tail).vectorize(lanes);
  }
  Self& unroll(const VarOrRVar& var, const Expr& factor, TailStrategy tail = TailStrategy::Auto) {
    const VarOrRVar copies = frontend::fresh_like(var);
    return split(var, var, copies, factor, tail).unroll(copies);
  }
  // Chooses whether loop partitioning separates boundary conditions and tails from the steady
  // state:
  //   for x in [0, n):                     for x in [0, 1):     body with its tests
  //     body(x), with boundary tests  =>   for x in [1, n - 1): body without tests
  //                                        for x in [n - 1, n): body with its tests
  // Auto leaves the choice to the compiler, Never keeps one loop, and Always partitions wherever
  // that removes a test.
  Self& partition(const VarOrRVar& var, Partition partition) {
    return give(graph::PartitionLoop{var.name(), partition});
  }
  // Keeps each of these loops in one piece.
  Self& never_partition(const std::vector<VarOrRVar>& vars) {
    return partition_all(vars, Partition::Never);
  }
  // Partitions each of these loops wherever that removes a test.
  Self& always_partition(const std::vector<VarOrRVar>& vars) {
    return partition_all(vars, Partition::Always);
  }
  // Keeps every loop of the stage in one piece.
  Self& never_partition_all() { return never_partition(frontend::loops_at(place())); }
  // Partitions every loop of the stage wherever that removes a test.
  Self& always_partition_all() { return always_partition(frontend::loops_at(place())); }
  template <std::convertible_to<VarOrRVar>... Rest>
  Self& never_partition(const VarOrRVar& x, Rest&&... rest) {
    return never_partition(std::vector<VarOrRVar>{x, VarOrRVar(std::forward<Rest>(rest))...});
  }
  template <std::convertible_to<VarOrRVar>... Rest>
  Self& always_partition(const VarOrRVar& x, Rest&&... rest) {
    return always_partition(std::vector<VarOrRVar>{x, VarOrRVar(std::forward<Rest>(rest))...});
  }

  // ---- reductions ----

  // Makes each read-modify-write of an element indivisible. Reduction loops may then run in
  // parallel, by atomic operations or locks, or be vectorized, by a reduction of the vector
  // followed by one update:
  //   f(g(r)) += h(r)
  //   parallel for r:                parallel for r:
  //     f[g(r)] = f[g(r)] + h(r)  =>   atomic: f[g(r)] = f[g(r)] + h(r)
  // For such a loop the update must be provably associative and commutative. The proof assumes
  // exact arithmetic, so rounding of floats, and the winner among ties of argmin, may depend on the
  // order of threads.
  // override_associativity_test: skips the proof; the caller guarantees the property.
  // Requires: an atomic update is associative and commutative; an atomic update reads no element of
  // its Func but the one that it writes; the values of a Tuple are updated under a lock, which must
  // not be left (Unsupported).
  Self& atomic(bool override_associativity_test = false) {
    return give(graph::MakeAtomic{override_associativity_test});
  }
  // Permits parallel and vectorized reduction loops whose iterations access the same elements. The
  // result is then any that a race can produce.
  Self& allow_race_conditions() { return give(graph::AllowRaces{}); }

  // ---- where it runs ----

  // Fuses the loops of this stage with those of another one, from the outermost down to the given
  // loop. In the shared loop the other stage runs first:
  //   for y: for x: f(x, y)               for y:
  //   for y: for x: g(x, y)          =>     for x: f(x, y)
  //   g.compute_with(f, y)                  for x: g(x, y)
  // Both stages must be computed at the same place, and neither may read the other. An update may
  // also join the stage before it, f.update().compute_with(Stage(f), y), so that sums start while
  // their elements are in the cache. Each iteration then accesses only elements that the stage
  // before computed in the same iteration. If the ranges of the loops differ, the shared loop
  // covers both, and each stage runs only within its own range. `align` shifts the ranges:
  // AlignStart makes them begin together, AlignEnd end together; NoAlign and Auto do not shift. The
  // stage that joins must not be specialized.
  // Requires: a stage joins the loops of another one down to a loop; within one Func, a stage joins
  // the stage before it; stages of one Func that share loops touch the same elements in each
  // iteration; the stage has loops; a stage that joins the loops of another one has no
  // specializations; the loop level is set before the pipeline is compiled; both stages belong to
  // the pipeline and are computed somewhere; both stages have loops; both stages are computed at
  // one place; both stages are computed at the same place; compute_with names one stage; the level
  // is a loop of both stages; both stages have the same loops down to the level; loops that run as
  // one are of one kind; loops that run as one are partitioned alike; what is prefetched in shared
  // loops is prefetched by the stage whose loops they are; one of the stages that share loops is
  // the first; Funcs that share loops do not depend on each other; the stages of a Func run one
  // after another, also where others run with them; what is computed together is computed after all
  // that any of it reads; Funcs that share loops are computed whenever any of them is needed
  // (Unsupported).
  Self& compute_with(const LoopLevel& level,
                     const std::vector<std::pair<VarOrRVar, LoopAlignStrategy>>& align) {
    graph::ComputeWith with{{{}, level.contents()}};
    for (const auto& [var, strategy] : align) with.align.emplace_back(var.name(), strategy);
    return give(std::move(with));
  }
  Self& compute_with(const LoopLevel& level, LoopAlignStrategy align = LoopAlignStrategy::Auto) {
    std::vector<std::pair<VarOrRVar, LoopAlignStrategy>> all;
    for (const VarOrRVar& loop : frontend::loops_at(place())) {
      if (align != LoopAlignStrategy::Auto) all.emplace_back(loop, align);
    }
    return compute_with(level, all);
  }
  Self& compute_with(const Stage& stage, const VarOrRVar& var,
                     const std::vector<std::pair<VarOrRVar, LoopAlignStrategy>>& align) {
    return compute_with(frontend::level_of(stage, var), align);
  }
  Self& compute_with(const Stage& stage, const VarOrRVar& var,
                     LoopAlignStrategy align = LoopAlignStrategy::Auto) {
    return compute_with(frontend::level_of(stage, var), align);
  }

  // Adds a second schedule, which runs if `condition` over parameters holds. The returned stage
  // holds it. It starts as a copy of the schedule so far; later directives of the general stage do
  // not affect it. f.specialize(n > 64).vectorize(x, 8):
  //   for x:          if n > 64: for x: for x' in [0, 8): body   (vectorized)
  //     body(x)   =>  else:      for x: body(x)
  // Conditions are tested in order. The same condition returns the same stage again.
  // Requires: the condition is a defined expression; the condition is of type bool; the condition
  // has one value in each call: it is made of parameters and facts about buffers; specialize_fail
  // is the last of a stage's specializations; a stage that joins the loops of another one has no
  // specializations.
  Stage specialize(const Expr& condition);
  // Makes the call fail with this message, instead of running the general schedule, if no
  // condition holds.
  // Requires: the message says something; specialize_fail is the last of a stage's specializations.
  void specialize_fail(const std::string& message) { give(graph::SpecializeFail{message}); }

  // Prefetches into the cache the region of a Func or image that iteration `from + offset` reads.
  // The prefetch happens in every iteration of `at`, which is `from` or a loop inside it.
  // g.prefetch(f, x, x, 2):
  //   for x:                for x:
  //     g(x) = 2 * f(x)  =>   prefetch(f[x + 2])
  //                           g(x) = 2 * f(x)
  // Requires: it needs a definition first; it is a Func or an image that is prefetched; the
  // prefetch happens at the loop it counts from, or inside that loop; the offset is an integer.
  Self& prefetch(const Func& f, const VarOrRVar& at, const VarOrRVar& from, Expr offset = 1,
                 PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf) {
    return give(frontend::prefetch_of(place(), f,
                                      {{}, at.name(), from.name(), std::move(offset), strategy}));
  }
  Self& prefetch(const std::shared_ptr<graph::ParameterContents>& image, const VarOrRVar& at,
                 const VarOrRVar& from, Expr offset = 1,
                 PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf) {
    return give(frontend::prefetch_of(place(), image,
                                      {{}, at.name(), from.name(), std::move(offset), strategy}));
  }
  template <typename T>
  requires requires(const T& image) { image.parameter(); }
  Self& prefetch(const T& image, const VarOrRVar& at, const VarOrRVar& from, Expr offset = 1,
                 PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf) {
    return prefetch(image.parameter(), at, from, std::move(offset), strategy);
  }
  // Halide's deprecated form, in which `at` and `from` are the same loop.
  template <typename T>
  Self& prefetch(const T& source, const VarOrRVar& var, int offset = 1,
                 PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf) {
    return prefetch(source, var, var, Expr(offset), strategy);
  }

  // ---- GPUs ----
  //
  // Up to three outer loops over blocks become the grid of a kernel, and up to three loops over
  // threads inside them become its blocks. The innermost of each kind is dimension x. Other loops
  // between and inside them stay loops:
  //   gpu_blocks(xo), gpu_threads(xi):
  //   for xo:              kernel<<<extent of xo, extent of xi>>>:
  //     for xi:        =>    body(block.x, thread.x)
  //       body(xo, xi)
  // All threads of a block compute Funcs whose compute level is a loop over blocks, or a loop
  // between blocks and threads; such Funcs lie in shared memory. A Func that is computed inside the
  // loops over threads is private to a thread. The target needs the feature CUDA; other devices are
  // Unsupported.

  // Maps loops to the threads of a block, at most 1,024 in all.
  // Requires: iterations that run at the same time must not touch the same element; a directive for
  // GPUs names a GPU; code for GPUs is generated for CUDA (Unsupported); the target has a GPU;
  // threads belong to blocks; blocks consist of threads; threads compute vectors, and no vector has
  // threads; a kernel cannot call functions of the host (Unsupported); kernels are launched by one
  // thread of the host (Unsupported).
  Self& gpu_threads(const VarOrRVar& x, DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuThread, {x}, device);
  }
  Self& gpu_threads(const VarOrRVar& x, const VarOrRVar& y,
                    DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuThread, {x, y}, device);
  }
  Self& gpu_threads(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& z,
                    DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuThread, {x, y, z}, device);
  }
  // Maps a loop to the lanes of a warp. It must be the innermost loop over threads, with at most 32
  // iterations; the rules of gpu_threads apply.
  Self& gpu_lanes(const VarOrRVar& x, DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuLane, {x}, device);
  }
  // Maps loops to the blocks of a grid; the rules of gpu_threads apply.
  Self& gpu_blocks(const VarOrRVar& x, DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuBlock, {x}, device);
  }
  Self& gpu_blocks(const VarOrRVar& x, const VarOrRVar& y,
                   DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuBlock, {x, y}, device);
  }
  Self& gpu_blocks(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& z,
                   DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuBlock, {x, y, z}, device);
  }
  // Maps loops to blocks and threads: gpu_blocks and gpu_threads in one call.
  Self& gpu(const VarOrRVar& block_x, const VarOrRVar& thread_x,
            DeviceAPI device = DeviceAPI::Default_GPU) {
    return gpu_blocks(block_x, device).gpu_threads(thread_x, device);
  }
  Self& gpu(const VarOrRVar& block_x, const VarOrRVar& block_y, const VarOrRVar& thread_x,
            const VarOrRVar& thread_y, DeviceAPI device = DeviceAPI::Default_GPU) {
    return gpu_blocks(block_x, block_y, device).gpu_threads(thread_x, thread_y, device);
  }
  Self& gpu(const VarOrRVar& block_x, const VarOrRVar& block_y, const VarOrRVar& block_z,
            const VarOrRVar& thread_x, const VarOrRVar& thread_y, const VarOrRVar& thread_z,
            DeviceAPI device = DeviceAPI::Default_GPU) {
    return gpu_blocks(block_x, block_y, block_z, device)
        .gpu_threads(thread_x, thread_y, thread_z, device);
  }
  // Runs the whole stage on one thread of one block.
  // Requires: code for GPUs is generated for CUDA (Unsupported).
  Self& gpu_single_thread(DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuBlock, {Var::outermost()}, device);
  }
  // Tiles up to three loops, with one block for each tile and one thread for each point of a tile.
  // Without names for the loops over blocks, these keep the names of the original loops.
  // gpu_tile(x, y, xi, yi, 16, 8):
  //   for y:                 gpu_block for y, x:
  //     for x:         =>      gpu_thread for yi in [0, 8), xi in [0, 16):
  //       body(x, y)             body(16 * x + xi, 8 * y + yi)
  Self& gpu_tile(const VarOrRVar& x, const VarOrRVar& bx, const VarOrRVar& tx, const Expr& x_size,
                 TailStrategy tail = TailStrategy::Auto,
                 DeviceAPI device = DeviceAPI::Default_GPU) {
    return split(x, bx, tx, x_size, tail).gpu(bx, tx, device);
  }
  Self& gpu_tile(const VarOrRVar& x, const VarOrRVar& tx, const Expr& x_size,
                 TailStrategy tail = TailStrategy::Auto,
                 DeviceAPI device = DeviceAPI::Default_GPU) {
    return gpu_tile(x, x, tx, x_size, tail, device);
  }
  Self& gpu_tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& bx, const VarOrRVar& by,
                 const VarOrRVar& tx, const VarOrRVar& ty, const Expr& x_size, const Expr& y_size,
                 TailStrategy tail = TailStrategy::Auto,
                 DeviceAPI device = DeviceAPI::Default_GPU) {
    return tile(x, y, bx, by, tx, ty, x_size, y_size, tail).gpu(bx, by, tx, ty, device);
  }
  Self& gpu_tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& tx, const VarOrRVar& ty,
                 const Expr& x_size, const Expr& y_size, TailStrategy tail = TailStrategy::Auto,
                 DeviceAPI device = DeviceAPI::Default_GPU) {
    return gpu_tile(x, y, x, y, tx, ty, x_size, y_size, tail, device);
  }
  Self& gpu_tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& z, const VarOrRVar& bx,
                 const VarOrRVar& by, const VarOrRVar& bz, const VarOrRVar& tx, const VarOrRVar& ty,
                 const VarOrRVar& tz, const Expr& x_size, const Expr& y_size, const Expr& z_size,
                 TailStrategy tail = TailStrategy::Auto,
                 DeviceAPI device = DeviceAPI::Default_GPU) {
    return tile({x, y, z}, {bx, by, bz}, {tx, ty, tz}, {x_size, y_size, z_size}, tail)
        .gpu(bx, by, bz, tx, ty, tz, device);
  }
  Self& gpu_tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& z, const VarOrRVar& tx,
                 const VarOrRVar& ty, const VarOrRVar& tz, const Expr& x_size, const Expr& y_size,
                 const Expr& z_size, TailStrategy tail = TailStrategy::Auto,
                 DeviceAPI device = DeviceAPI::Default_GPU) {
    return gpu_tile(x, y, z, x, y, z, tx, ty, tz, x_size, y_size, z_size, tail, device);
  }

  // ---- accelerators: Unsupported ----

  // Always throws: there is no code for Hexagon.
  // Requires: loops run on the CPU or a CUDA device (Unsupported).
  Self& hexagon(const VarOrRVar& x = Var::outermost()) {
    frontend::check_device(place(), {x}, DeviceAPI::Hexagon);
    return self();
  }

  // Inlines these Funcs into this definition immediately, so that later directives, such as
  // rfactor, see the result. Other consumers still call the Funcs.
  //   g(x) = x * x                    g(x) = x * x
  //   f(x) = g(x) + g(x + 1)     =>   f(x) = x * x + (x + 1) * (x + 1)
  // Requires: an inlined Func has one pure definition; an inlined Func has no schedule of its own.
  Self& eager_inline(const std::vector<Func>& funcs);
  template <std::same_as<Func>... Rest>
  Self& eager_inline(const Func& first, const Rest&... rest) {
    return eager_inline(std::vector<Func>{first, rest...});
  }
  // Hints that stored values are not read again soon. Today this changes no code: all stores go
  // through the caches.
  Self& stream_stores() { return hint(); }
  // Hints that loaded values, of all Funcs or the given ones, are not read again soon. Today this
  // changes no code: all loads go through the caches.
  Self& stream_loads() { return hint(); }
  Self& stream_loads(const std::vector<Func>&) { return hint(); }

  // States that this stage has no directives on purpose, which silences warnings.
  void unscheduled() { give(graph::Unscheduled{}); }
  // The schedule as the compiler stores it.
  const graph::StageLoops& get_schedule() const { return place().schedule(); }

 private:
  Self& self() { return static_cast<Self&>(*this); }
  graph::SchedulePlace place() const { return static_cast<const Self&>(*this).loops(); }
  Self& hint() {
    place().schedule();  // is a stage that has loops
    return self();
  }
  template <typename D>
  Self& give(D directive) {
    graph::give_directive(place(), std::move(directive));
    return self();
  }
  Self& partition_all(const std::vector<VarOrRVar>& vars, Partition how) {
    for (const VarOrRVar& var : vars) partition(var, how);
    return self();
  }
  // Checks all loops before it changes the first.
  Self& run_on_gpu(ForType kind, const std::vector<VarOrRVar>& loops, DeviceAPI device) {
    frontend::check_device(place(), loops, device);
    for (const VarOrRVar& loop : loops) frontend::check_run(place(), loop, kind);
    for (const VarOrRVar& loop : loops) give(graph::RunLoop{loop.name(), kind});
    return self();
  }
};

}  // namespace retrograde
