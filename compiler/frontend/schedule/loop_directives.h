// loop_directives.h -- the schedule of one definition: its loops. A Stage has these methods, and so
// has a Func, for its first definition.
//
// Directives change in which order and how the points of a definition are computed, never what is
// computed. A stage starts with one loop for each variable: the reduction variables innermost, in
// their order, then the pure variables. All directives name loops by Var or RVar and throw
// CompileError when that breaks a rule.
#pragma once

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "frontend/language/var_or_rvar.h"
#include "frontend/schedule/loop_level.h"
#include "graph/give_directive.h"
#include "graph/inline_calls.h"
#include "ir/target.h"

namespace retrograde {

class Func;
class Stage;

namespace frontend {

// What the methods below are made of.
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

}  // namespace frontend

// Requires: a name must be a loop of this stage; the loops of a stage have different names; only
// what is computed somewhere has loops; a size has one value in each call: it is made of parameters
// and facts about buffers.
template <class Self>
class LoopDirectives {
 public:
  // ---- the shape of the loops ----

  //   for x in [0, n):        for xo in [0, ceil(n / f)):
  //     body(x)          =>     for xi in [0, f):
  //                               body(xo * f + xi)
  // What happens when f does not divide n is the tail strategy's: see TailStrategy. ShiftInwards is
  // for first definitions; a loop over a reduction variable takes GuardWithIf or Predicate.
  // Requires: the factor must be a defined expression; a factor is an integer; a factor is at least
  // 1; a factor fits an int32; the two new loops have different names; a loop over a reduction
  // variable runs exactly over its domain; an update definition does not run a point twice.
  Self& split(const VarOrRVar& old, const VarOrRVar& outer, const VarOrRVar& inner,
              const Expr& factor, TailStrategy tail = TailStrategy::Auto) {
    return give(graph::SplitLoop{old.name(), outer.name(), inner.name(), factor, tail});
  }
  //   for y in [0, m):           for t in [0, n * m):
  //     for x in [0, n):    =>     body(t % n, t / n)
  //       body(x, y)
  // The fused loop runs as the outer one did. A pure loop with a reduction loop gives the latter.
  // Requires: it takes two loops; iterations that run at the same time must not touch the same
  // element.
  Self& fuse(const VarOrRVar& inner, const VarOrRVar& outer, const VarOrRVar& fused) {
    return give(graph::FuseLoops{inner.name(), outer.name(), fused.name()});
  }
  //   for x:          for t:
  //     body(x)   =>    body(t)
  Self& rename(const VarOrRVar& old_name, const VarOrRVar& new_name) {
    return give(graph::RenameLoop{old_name.name(), new_name.name()});
  }
  // Innermost first; loops that are not named keep their places. reorder(y, x):
  //   for y:            for x:
  //     for x:     =>     for y:
  //       body(x, y)        body(x, y)
  // Reduction loops change places among each other only where that is known to change no result.
  // Requires: each loop is named once; the order of reduction loops may change only where it
  // changes no result.
  Self& reorder(const std::vector<VarOrRVar>& vars) { return give(frontend::reorder_of(vars)); }
  template <std::convertible_to<VarOrRVar>... Rest>
  Self& reorder(const VarOrRVar& x, const VarOrRVar& y, Rest&&... rest) {
    return reorder(std::vector<VarOrRVar>{x, y, VarOrRVar(std::forward<Rest>(rest))...});
  }
  // Splits both and runs block after block: loops xi, yi, xo, yo, innermost first.
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

  Self& serial(const VarOrRVar& var) { return give(graph::RunLoop{var.name(), ForType::Serial}); }
  //   for y:          parallel for y:      iterations are shared out to threads
  //     body(y)   =>    body(y)
  // A loop over a reduction variable only where its iterations are independent, the update is
  // atomic(), or race conditions are allowed.
  // Requires: iterations that run at the same time must not touch the same element; a parallel loop
  // is not inside of a vectorized one.
  Self& parallel(const VarOrRVar& var) {
    return give(graph::RunLoop{var.name(), ForType::Parallel});
  }
  //   for x in [0, 4):      body(ramp(0, 1, 4))
  //     body(x)         =>
  // Of a loop of constant extent; the same rule for reduction variables.
  // Requires: iterations that run at the same time must not touch the same element; the extent of a
  // vectorized loop must be a constant, or have a constant above it; vectors have at most 4096 lanes;
  // loops around the calls of a C function are serial, parallel or unrolled.
  Self& vectorize(const VarOrRVar& var) {
    return give(graph::RunLoop{var.name(), ForType::Vectorized});
  }
  //   for x in [0, 2):      body(0)
  //     body(x)         =>  body(1)
  // Of a loop of constant extent.
  // Requires: the extent of an unrolled loop must be a constant, or have a constant above it.
  Self& unroll(const VarOrRVar& var) { return give(graph::RunLoop{var.name(), ForType::Unrolled}); }
  // The same after a split; the outer loop keeps the name of `var`, except that a parallel loop is
  // the outer one.
  //   parallel(y, 4):            vectorize(x, 8), unroll(x, 8):
  //     parallel for y:            for x:
  //       for y' in [0, 4):          vectorized (unrolled) for x' in [0, 8):
  //         body(4 * y + y')           body(8 * x + x')
  Self& parallel(const VarOrRVar& var, const Expr& task_size,
                 TailStrategy tail = TailStrategy::Auto) {
    check_run(var, ForType::Parallel);
    return split(var, var, frontend::fresh_like(var), task_size, tail).parallel(var);
  }
  Self& vectorize(const VarOrRVar& var, const Expr& factor,
                  TailStrategy tail = TailStrategy::Auto) {
    check_run(var, ForType::Vectorized);
    const VarOrRVar lanes = frontend::fresh_like(var);
    return split(var, var, lanes, factor, tail).vectorize(lanes);
  }
  Self& unroll(const VarOrRVar& var, const Expr& factor, TailStrategy tail = TailStrategy::Auto) {
    const VarOrRVar copies = frontend::fresh_like(var);
    return split(var, var, copies, factor, tail).unroll(copies);
  }
  // Whether boundary conditions and tails get loops of their own:
  //   for x in [0, n):                     for x in [0, 1):     body with its tests
  //     body(x), with boundary tests  =>   for x in [1, n - 1): body without tests
  //                                        for x in [n - 1, n): body with its tests
  // Auto leaves it to the compiler, Never keeps one loop, Always cuts wherever a test can be
  // removed.
  Self& partition(const VarOrRVar& var, Partition partition) {
    return give(graph::PartitionLoop{var.name(), partition});
  }
  Self& never_partition(const std::vector<VarOrRVar>& vars) {
    return partition_all(vars, Partition::Never);
  }
  Self& always_partition(const std::vector<VarOrRVar>& vars) {
    return partition_all(vars, Partition::Always);
  }
  Self& never_partition_all() { return never_partition(frontend::loops_at(place())); }
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

  // What an iteration reads and writes of one element is indivisible, so that loops over reduction
  // variables may run in parallel (atomic operations or locks) or be vectorized (a reduction of the
  // vector, then one update):
  //   f(g(r)) += h(r)
  //   parallel for r:                parallel for r:
  //     f[g(r)] = f[g(r)] + h(r)  =>   atomic: f[g(r)] = f[g(r)] + h(r)
  // The update must be proven associative and commutative when such a loop is asked for; of floats,
  // and of ties in argmin and its like, in exact arithmetic only: results may then depend on the
  // order of threads. `override_associativity_test`: the caller vouches for it.
  // Requires: an atomic update is associative and commutative; an atomic update reads no element of
  // its Func but the one that it writes; the values of a Tuple are updated under a lock, which must
  // not be left (Unsupported).
  Self& atomic(bool override_associativity_test = false) {
    return give(graph::MakeAtomic{override_associativity_test});
  }
  // Loops over reduction variables may run in parallel or as vectors although their iterations
  // touch the same elements: results may then be any of those that races give.
  Self& allow_race_conditions() { return give(graph::AllowRaces{}); }

  // ---- where it runs ----

  // Runs this stage inside the loops of another one, down to the given loop, after it:
  //   for y: for x: f(x, y)               for y:
  //   for y: for x: g(x, y)          =>     for x: f(x, y)
  //   g.compute_with(f, y)                  for x: g(x, y)
  // Both are computed at the same place, and neither reads the other. An update may join the stage
  // before it, f.update().compute_with(Stage(f), y), so that sums start where they are in the cache:
  // each iteration then touches what the stage before has made in it, and nothing else. Where their ranges differ the
  // common loop covers both, shifted as `align` says, and each runs only within its own:
  // AlignStart lets the ranges begin together, AlignEnd end together, NoAlign and Auto shift
  // nothing. The stage that joins has no specializations.
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

  // A second schedule for when `condition`, over parameters only, holds: the returned stage, which
  // starts as a copy of the schedule so far. Directives given to the general stage afterwards are
  // not its own.  f.specialize(n > 64).vectorize(x, 8):
  //   for x:          if n > 64: for x: for x' in [0, 8): body   (vectorized)
  //     body(x)   =>  else:      for x: body(x)
  // Conditions are tried in the order given; the same condition gives the same stage again.
  // Requires: the condition is a defined expression; the condition is of type bool; the condition
  // has one value in each call: it is made of parameters and facts about buffers; specialize_fail
  // is the last of a stage's specializations; a stage that joins the loops of another one has no
  // specializations.
  Stage specialize(const Expr& condition);
  // When none of the conditions holds, the call fails with this message instead of running the
  // general schedule.
  // Requires: the message says something; specialize_fail is the last of a stage's specializations.
  void specialize_fail(const std::string& message) { give(graph::SpecializeFail{message}); }

  // Fetches into the cache what iteration `from + offset` reads of an image or Func, at every
  // iteration of `at`, which is `from` or a loop inside of it. g.prefetch(f, x, x, 2):
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
  // Deprecated in Halide: `at` and `from` are one loop.
  template <typename T>
  Self& prefetch(const T& source, const VarOrRVar& var, int offset = 1,
                 PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf) {
    return prefetch(source, var, var, Expr(offset), strategy);
  }

  // ---- GPUs ----
  //
  // Loops over blocks, the outer ones, become the grid of a kernel, and loops over threads in them its
  // blocks; of each kind at most three, the innermost of which is x. What is between and inside of
  // them stays loops:
  //   gpu_blocks(xo), gpu_threads(xi):
  //   for xo:              kernel<<<extent of xo, extent of xi>>>:
  //     for xi:        =>    body(block.x, thread.x)
  //       body(xo, xi)
  // Funcs computed at a loop over blocks, or at a loop in it, are computed by all threads of the block
  // and lie in memory that these share; what is computed inside of threads is a thread's own.
  // The target has the feature CUDA. Only CUDA devices are known (Unsupported).

  // Loops whose iterations are threads of a block: at most 1,024 altogether.
  // Requires: iterations that run at the same time must not touch the same element; a directive for
  // GPUs names a GPU; code for GPUs is made for CUDA (Unsupported); the target has a GPU; threads belong
  // to blocks; blocks consist of threads; threads compute vectors, and no vector has threads; a kernel
  // computes, and calls nothing of the host (Unsupported); kernels are launched by one thread of the
  // host (Unsupported).
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
  // A loop whose iterations are lanes of a warp: the innermost over threads, of an extent of at most 32.
  // What gpu_threads requires.
  Self& gpu_lanes(const VarOrRVar& x, DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuLane, {x}, device);
  }
  // Loops whose iterations are blocks of a grid.
  // What gpu_threads requires.
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
  // Blocks and threads at once.
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
  // The whole stage in one thread of one block.
  // Requires: code for GPUs is made for CUDA (Unsupported).
  Self& gpu_single_thread(DeviceAPI device = DeviceAPI::Default_GPU) {
    return run_on_gpu(ForType::GpuBlock, {Var::outermost()}, device);
  }
  // Tiles, a block each, a thread for each of their points; blocks keep the names of the loops where
  // none are given. gpu_tile(x, y, xi, yi, 16, 8):
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
  // Requires: loops run on the CPU or a CUDA device (Unsupported).
  Self& hexagon(const VarOrRVar& x = Var::outermost()) {
    frontend::check_device(place(), {x}, DeviceAPI::Hexagon);
    return self();
  }

  // Substitutes these Funcs into this definition, now: what later directives look at, such as
  // rfactor, is what came of it. Other users of the Funcs still call them.
  //   g(x) = x * x                    g(x) = x * x
  //   f(x) = g(x) + g(x + 1)     =>   f(x) = x * x + (x + 1) * (x + 1)
  // Requires: an inlined Func has one pure definition; an inlined Func has no schedule of its own.
  Self& eager_inline(const std::vector<Func>& funcs);
  template <std::same_as<Func>... Rest>
  Self& eager_inline(const Func& first, const Rest&... rest) {
    return eager_inline(std::vector<Func>{first, rest...});
  }
  // Hints that what this stage stores, or loads (of these Funcs), is not used again soon. They change
  // no value, and today no code either: all stores and loads go through the caches.
  Self& stream_stores() { return hint(); }
  Self& stream_loads() { return hint(); }
  Self& stream_loads(const std::vector<Func>&) { return hint(); }

  void unscheduled() { give(graph::Unscheduled{}); }  // says that no directive was forgotten
  const graph::StageLoops& get_schedule() const { return place().schedule(); }

 private:
  Self& self() { return static_cast<Self&>(*this); }
  graph::SchedulePlace place() const { return static_cast<const Self&>(*this).loops(); }
  Self& hint() {
    place().schedule();  // is a stage that has loops
    return self();
  }
  Self& give(graph::Directive directive) {
    graph::give_directive(place(), std::move(directive));
    return self();
  }
  Self& partition_all(const std::vector<VarOrRVar>& vars, Partition how) {
    for (const VarOrRVar& var : vars) partition(var, how);
    return self();
  }
  // What is asked for is refused before the loop is split.
  void check_run(const VarOrRVar& var, ForType kind) const {
    graph::Directive run = graph::RunLoop{var.name(), kind};
    graph::check_directive(place(), run);
  }
  // All are checked before the first is given.
  Self& run_on_gpu(ForType kind, const std::vector<VarOrRVar>& loops, DeviceAPI device) {
    frontend::check_device(place(), loops, device);
    for (const VarOrRVar& loop : loops) check_run(loop, kind);
    for (const VarOrRVar& loop : loops) give(graph::RunLoop{loop.name(), kind});
    return self();
  }
};

}  // namespace retrograde
