#include "testing/random_gpu_schedule.h"

#include <map>
#include <set>

#include "frontend/language/func.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::fuzz {

namespace {

// A stage; where its loops run over blocks, something may be computed in them.
struct Site {
  const graph::FuncContents* func;
  int stage;
  auto operator<=>(const Site&) const = default;
};
struct Blocks {
  Func func;
  std::string outermost;
};

class GpuScheduler {
 public:
  explicit GpuScheduler(Choices& choices) : choices_(choices) {}

  // Users come after what they use, and are scheduled first.
  void run(const RandomProgram& program) {
    for (const Func& f : program.funcs) {
      if (f.defined()) known_.insert(f.function().get());
    }
    for (const Func& f : program.outputs) outputs_.insert(f.function().get());
    for (auto f = program.funcs.rbegin(); f != program.funcs.rend(); ++f) {
      if (f->defined() && !f->is_extern()) schedule(*f);
    }
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
      in_block(f, blocks_.at(*users.begin()), *users.begin());
      return used_in(f, users);
    }
    f.compute_root();
    for (int stage = 0; stage <= f.num_update_definitions(); ++stage) {
      if (!choices_.chance(15)) on_blocks(f, stage, is_output);
      note_uses(*contents, stage, {{contents, stage}});
    }
  }

  // What f uses is used where f is computed.
  void used_in(const Func& f, const std::set<Site>& sites) {
    for (int stage = 0; stage <= f.num_update_definitions(); ++stage)
      note_uses(*f.function(), stage, sites);
  }

  // Funcs of boundary conditions and inline reductions stand for what they read.
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

  struct Loops {
    std::vector<VarOrRVar> pure, reductions;
  };
  static Loops loops_of(const Stage& stage) {
    Loops loops;
    for (const graph::Dim& dim : stage.get_schedule().dims)
      (dim.is_reduction ? loops.reductions : loops.pure).emplace_back(dim.var, dim.is_reduction);
    return loops;
  }

  void on_blocks(Func f, int number, bool is_output) {
    Stage stage = stage_of(f, number);
    const Loops loops = loops_of(stage);
    if (loops.pure.empty()) {
      if (choices_.chance(60)) stage.gpu_single_thread();
      return;
    }
    const auto most = static_cast<int>(std::min<size_t>(loops.pure.size(), 3));
    const int tiled = choices_.between(1, most);
    std::vector<VarOrRVar> order = loops.reductions, threads, blocks;
    for (int d = 0; d < tiled; ++d) {
      const VarOrRVar inner = Var();
      // Outputs are as small as they come.
      const TailStrategy tail =
          is_output
              ? choices_.pick<TailStrategy>({TailStrategy::GuardWithIf, TailStrategy::Predicate})
              : choices_.pick<TailStrategy>(
                    {TailStrategy::GuardWithIf, TailStrategy::Auto, TailStrategy::Predicate});
      stage.split(loops.pure[static_cast<size_t>(d)], loops.pure[static_cast<size_t>(d)], inner,
                  choices_.pick<int>({4, 1, 2, 3, 8}), tail);
      threads.push_back(inner);
      blocks.push_back(loops.pure[static_cast<size_t>(d)]);
    }
    const std::vector<VarOrRVar> serial(loops.pure.begin() + tiled, loops.pure.end());
    order.insert(order.end(), serial.begin(), serial.end());
    order.insert(order.end(), threads.begin(), threads.end());
    order.insert(order.end(), blocks.begin(), blocks.end());
    if (order.size() > 1) stage.reorder(order);
    for (const VarOrRVar& block : blocks) stage.gpu_blocks(block);
    for (const VarOrRVar& thread : threads) {
      if (!choices_.chance(10)) stage.gpu_threads(thread);
    }
    blocks_[{f.function().get(), number}] = {f, blocks.front().name()};
  }

  // By the threads of a block that uses it.
  void in_block(Func f, const Blocks& blocks, const Site& site) {
    f.compute_at(LoopLevel(blocks.func, Var(blocks.outermost), site.stage));
    // Registers are for what each thread makes for itself, which is seldom so.
    if (choices_.chance(4)) {
      f.store_in(MemoryType::Register);
    } else if (choices_.chance(25)) {
      f.store_in(choices_.pick<MemoryType>({MemoryType::Heap, MemoryType::GPUShared}));
    }
    for (int stage = 0; stage <= f.num_update_definitions(); ++stage) {
      Stage here = stage_of(f, stage);
      const Loops loops = loops_of(here);
      const auto most = static_cast<int>(std::min<size_t>(loops.pure.size(), 3));
      const int over_threads = choices_.between(0, most);
      for (int d = 0; d < over_threads; ++d) here.gpu_threads(loops.pure[static_cast<size_t>(d)]);
    }
  }

  Choices& choices_;
  std::set<const Contents*> known_, outputs_;
  std::map<const Contents*, std::set<Site>> users_;
  std::map<Site, Blocks> blocks_;
};

}  // namespace

void schedule_on_gpu(const RandomProgram& program, Choices& choices) {
  GpuScheduler(choices).run(program);
}

}  // namespace retrograde::fuzz
