#include "testing/random_gpu_schedule.h"

#include <algorithm>
#include <map>
#include <set>

#include "frontend/language/func.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"
#include "ir/visit.h"
#include "testing/random_loops.h"

namespace retrograde::fuzz {

namespace {

// A stage. If its loops run over blocks, Funcs may be computed in them.
struct Site {
  const graph::FuncContents* func;
  int stage;
  auto operator<=>(const Site&) const = default;
};
struct Blocks {
  Func func;
  VarOrRVar loop;
};

class GpuScheduler {
 public:
  explicit GpuScheduler(Choices& choices) : choices_(choices) {}

  // Consumers come after their producers and are scheduled first.
  GpuScheduleCounts run(const RandomProgram& program) {
    for (const Func& f : program.funcs) {
      if (f.defined()) known_.insert(f.function().get());
    }
    for (const Func& f : program.outputs) outputs_.insert(f.function().get());
    for (auto f = program.funcs.rbegin(); f != program.funcs.rend(); ++f) {
      if (f->defined() && !f->is_extern()) schedule(*f);
    }
    return std::move(counts_);
  }

 private:
  using Contents = graph::FuncContents;

  void schedule(Func f) {
    const Contents* contents = f.function().get();
    const std::set<Site> users = users_[contents];
    const bool is_simple = f.num_update_definitions() == 0, is_output = outputs_.count(contents);
    const bool is_in_one = users.size() == 1 && blocks_.count(*users.begin());
    if (is_simple && !is_output && choices_.chance(20)) return used_in(f, users);  // inlined
    if (is_in_one && !is_output && choices_.chance(70)) {
      const std::vector<Func> parts = in_block(f, blocks_.at(*users.begin()), *users.begin());
      used_in(f, users);
      for (const Func& part : parts) schedule(part);
      return;
    }
    f.compute_root();
    std::vector<Func> parts;
    for (int stage = 0; stage <= f.num_update_definitions(); ++stage) {
      cut(f, stage, parts);
      if (!choices_.chance(15)) on_blocks(f, stage, is_output);
      note_uses(*contents, stage, {{contents, stage}});
    }
    for (const Func& part : parts) schedule(part);
  }

  // Factors an update into partial results, if it allows that; these are a Func like any other.
  void cut(Func& f, int number, std::vector<Func>& parts) {
    if (!is_associative_update(*f.function(), number) || !choices_.chance(35)) return;
    std::vector<VarOrRVar> reductions = loops_of(f.update(number - 1)).reductions;
    if (reductions.empty()) return;
    RVar kept = choices_.pick(reductions).rvar;
    if (choices_.chance(60)) {
      const RVar outer(names_.fresh("ro")), inner(names_.fresh("ri"));
      f.update(number - 1).split(kept, outer, inner, choices_.between(2, 4));
      kept = choices_.chance(50) ? outer : inner;
    }
    const Func part = f.update(number - 1).rfactor(kept, Var(names_.fresh("u")));
    known_.insert(part.function().get());
    parts.push_back(part);
    ++counts_["partial results"];
  }

  // Makes updates atomic, so that several threads may update one element at a time. Reductions then run like pure
  // loops.
  void make_atomic(const Func& f, int number, Stage& stage, std::vector<VarOrRVar>& pure,
                   std::vector<VarOrRVar>& reductions) {
    const bool may_be = !reductions.empty() && f.outputs() == 1;
    if (!may_be || !is_associative_update(*f.function(), number) || !choices_.chance(50)) return;
    stage.atomic();
    pure.insert(choices_.chance(50) ? pure.begin() : pure.end(), reductions.begin(),
                reductions.end());
    reductions.clear();
    ++counts_["atomic updates"];
  }

  // The producers of f are used where f is computed.
  void used_in(const Func& f, const std::set<Site>& sites) {
    for (int stage = 0; stage <= f.num_update_definitions(); ++stage)
      note_uses(*f.function(), stage, sites);
  }

  // Funcs of boundary conditions and inline reductions count as uses of the Funcs that they read.
  void note_uses(const Contents& f, int stage, const std::set<Site>& sites) {
    graph::walk(f.stage(stage), [&](const ir::Call& call) {
      if (call.call_type != ir::CallType::Func || call.symbol.raw() == &f) return;
      const graph::FuncPtr callee = graph::func_of(call);
      users_[callee.get()].insert(sites.begin(), sites.end());
      if (known_.count(callee.get())) return;
      for (int s = 0; s < callee->stage_count(); ++s) note_uses(*callee, s, sites);
    });
  }

  static Stage stage_of(Func& f, int stage) { return stage == 0 ? Stage(f) : f.update(stage - 1); }

  struct StageLoops {
    std::vector<VarOrRVar> pure, reductions;
  };
  static StageLoops loops_of(const Stage& stage) {
    StageLoops loops;
    for (const graph::Dim& dim : stage.get_schedule().dims)
      (dim.is_reduction ? loops.reductions : loops.pure).emplace_back(dim.var, dim.is_reduction);
    return loops;
  }

  void on_blocks(Func f, int number, bool is_output) {
    Stage stage = stage_of(f, number);
    StageLoops loops = loops_of(stage);
    make_atomic(f, number, stage, loops.pure, loops.reductions);
    if (loops.pure.empty()) {
      if (choices_.chance(60)) stage.gpu_single_thread();
      return;
    }
    ++counts_["kernels"];
    const auto most = static_cast<int>(std::min<size_t>(loops.pure.size(), 3));
    const int tiled = choices_.between(1, most);
    std::vector<VarOrRVar> order = loops.reductions, threads, blocks;
    if (number == 0 && choices_.chance(15)) order.push_back(vectors(stage, loops.pure[0]));
    for (int d = 0; d < tiled; ++d) {
      const VarOrRVar& outer = loops.pure[static_cast<size_t>(d)];
      const VarOrRVar inner = outer.is_rvar ? VarOrRVar(RVar(names_.fresh("ri"))) : Var();
      const TailStrategy tail_of_split = tail(is_output);
      stage.split(outer, outer, inner, tile_size(d), tail_of_split);
      threads.push_back(inner);
      blocks.push_back(outer);
    }
    const std::vector<VarOrRVar> serial(loops.pure.begin() + tiled, loops.pure.end());
    order.insert(order.end(), serial.begin(), serial.end());
    order.insert(order.end(), threads.begin(), threads.end());
    order.insert(order.end(), blocks.begin(), blocks.end());
    if (order.size() > 1) stage.reorder(order);
    for (const VarOrRVar& block : blocks) stage.gpu_blocks(block);
    run_as_threads(stage, threads);
    blocks_.insert_or_assign(Site{f.function().get(), number}, Blocks{f, blocks.front()});
  }

  // Vectorizes the work of a thread.
  VarOrRVar vectors(Stage& stage, const VarOrRVar& loop) {
    ++counts_["vectors in threads"];
    const VarOrRVar lane = Var();
    stage.split(loop, loop, lane, choices_.chance(50) ? 4 : 2, TailStrategy::GuardWithIf);
    stage.vectorize(lane);
    return lane;
  }

  // Sizes of rows of threads; some are whole warps.
  int tile_size(int dimension) {
    constexpr int warp = 32;
    return dimension == 0 && choices_.chance(10) ? warp : choices_.pick<int>({4, 1, 2, 3, 8});
  }

  // Tail strategies; outputs are limited to those that need no minimum size.
  TailStrategy tail(bool is_output) {
    if (is_output)
      return choices_.pick<TailStrategy>({TailStrategy::GuardWithIf, TailStrategy::Predicate});
    return choices_.pick<TailStrategy>(
        {TailStrategy::GuardWithIf, TailStrategy::Auto, TailStrategy::Predicate});
  }

  // Maps loops to threads. The innermost may become lanes; some stay loops of each thread.
  void run_as_threads(Stage& stage, const std::vector<VarOrRVar>& threads) {
    const bool has_lanes = choices_.chance(10);
    for (size_t d = 0; d < threads.size(); ++d) {
      const bool is_lane = has_lanes && d == 0;
      if (choices_.chance(10)) continue;
      is_lane ? stage.gpu_lanes(threads[d]) : stage.gpu_threads(threads[d]);
    }
  }

  // Computes f by the threads of a block that uses it. Returns the partial results into which updates were factored.
  std::vector<Func> in_block(Func f, const Blocks& blocks, const Site& site) {
    ++counts_["Funcs in blocks"];
    f.compute_at(LoopLevel(blocks.func, blocks.loop, site.stage));
    // Rarely, because registers suit only values that each thread computes for itself.
    if (choices_.chance(2)) {
      f.store_in(MemoryType::Register);
    } else if (choices_.chance(25)) {
      f.store_in(choices_.pick<MemoryType>({MemoryType::Heap, MemoryType::GPUShared}));
    }
    std::vector<Func> parts;
    for (int stage = 0; stage <= f.num_update_definitions(); ++stage) {
      cut(f, stage, parts);
      Stage here = stage_of(f, stage);
      StageLoops loops = loops_of(here);
      make_atomic(f, stage, here, loops.pure, loops.reductions);
      const auto most = static_cast<int>(std::min<size_t>(loops.pure.size(), 3));
      const int over_threads = choices_.between(0, most);
      for (int d = 0; d < over_threads; ++d) here.gpu_threads(loops.pure[static_cast<size_t>(d)]);
    }
    return parts;
  }

  Choices& choices_;
  LoopNames names_;
  GpuScheduleCounts counts_;
  std::set<const Contents*> known_, outputs_;
  std::map<const Contents*, std::set<Site>> users_;
  std::map<Site, Blocks> blocks_;
};

}  // namespace

GpuScheduleCounts schedule_on_gpu(const RandomProgram& program, Choices& choices) {
  return GpuScheduler(choices).run(program);
}

}  // namespace retrograde::fuzz
