#include "autoschedule/plan/plan.h"

#include <algorithm>
#include <type_traits>

#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/readers.h"
#include "diagnostics/error.h"

namespace retrograde::planning {

const char* opacity_name(Opacity opacity) {
  static constexpr std::array<const char*, opacity_count> names{
      "none",          "extern",       "prefetch",     "async",           "memoize",
      "ring",          "specialize",   "partition",    "symbolic_factor", "split_history",
      "symbolic_fold", "shared_loops", "unknown_loop", "different_loops"};
  return names[static_cast<size_t>(opacity)];
}

ProgramPtr make_program(const std::vector<graph::FuncPtr>& outputs) {
  auto program =
      std::make_shared<Program>(Program{outputs, graph::topological_order(outputs), {}, {}});
  for (const graph::FuncPtr& f : program->funcs) {
    RETROGRADE_ASSERT(f->wrappers.empty() && f->copied_inputs.empty(), "wrappers of ",
                      quoted(f->name), " are not applied");
  }
  program->readers = readers_of(program->funcs);
  program->iterators = mapped(program->funcs, [](const graph::FuncPtr& f) {
    return numbered(f->stage_count(), [&](int stage) { return iterators_of(*f, stage); });
  });
  return program;
}

bool is_output(const Program& program, FuncId func) {
  return std::ranges::find(program.outputs, program.funcs[static_cast<size_t>(func)]) !=
         program.outputs.end();
}

bool operator==(const Plan& a, const Plan& b) {
  const bool is_one = a.program == b.program || (a.program->funcs == b.program->funcs &&
                                                 a.program->outputs == b.program->outputs);
  return is_one && std::ranges::equal(a.funcs, b.funcs, [](const auto& f, const auto& g) {
           return f == g || *f == *g;
         });
}

namespace {

// Mixes the fields of a plan into one number; equal plans have equal numbers.
class PlanHash {
 public:
  template <typename T>
  requires std::is_integral_v<T> || std::is_enum_v<T>
  void operator()(T value) {
    value_ = (value_ ^ static_cast<uint64_t>(value)) * 0x9e3779b97f4a7c15u;
    value_ ^= value_ >> 29;
  }
  template <typename T>
  void operator()(const std::vector<T>& list) {
    (*this)(list.size());
    for (const T& one : list) (*this)(one);
  }
  template <typename... T>
  requires(sizeof...(T) > 1) void operator()(const T&... values) { ((*this)(values), ...); }

  void operator()(const LoopRef& loop) { (*this)(loop.stage.func, loop.stage.stage, loop.depth); }
  void operator()(const Part& part) {
    (*this)(part.iterator, part.step, part.in_blocks, part.tail);
  }
  void operator()(const Fusion& fusion) { (*this)(fusion.inner, fusion.outer); }
  void operator()(const Loop& loop) {
    (*this)(static_cast<const Part&>(loop), loop.kind, loop.align);
  }
  void operator()(const Nest& nest) {
    (*this)(nest.loops, nest.fusions, nest.shared_with.value_or(LoopRef()), nest.concurrency);
  }
  void operator()(const Fold& fold) { (*this)(fold.dimension, fold.extent, fold.forward); }
  void operator()(const Level& level) { (*this)(level.kind, level.loop, level.in_each_stage); }

  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0x243f6a8885a308d3u;
};

}  // namespace

uint64_t hash_of(const FuncPlan& plan) {
  PlanHash hash;
  hash(plan.placement.compute, plan.placement.store, plan.placement.hoist);
  hash(plan.storage.order, plan.storage.folds, plan.storage.memory);
  hash(plan.nests, plan.opacity);
  return hash.value();
}

namespace {

uint64_t hash_at(size_t func, const FuncPlan& plan) {
  PlanHash hash;
  hash(func, hash_of(plan));
  return hash.value();
}

}  // namespace

uint64_t hash_of(const Plan& plan) {
  uint64_t sum = 0;
  for (size_t f = 0; f < plan.funcs.size(); ++f) sum += hash_at(f, *plan.funcs[f]);
  return sum;
}

uint64_t hash_of(const Plan& plan, const Plan& before, uint64_t hash_before) {
  uint64_t sum = hash_before;
  for (size_t f = 0; f < plan.funcs.size(); ++f) {
    if (plan.funcs[f] != before.funcs[f])
      sum += hash_at(f, *plan.funcs[f]) - hash_at(f, *before.funcs[f]);
  }
  return sum;
}

bool is_inlined(const Plan& plan, FuncId func) {
  const FuncPlan& own = plan.of(func);
  const Level::Kind kind = own.placement.compute.kind;
  const bool is_left = kind == Level::Kind::Undecided && own.opacity == Opacity::None;
  return (kind == Level::Kind::Inline || is_left) && !is_output(*plan.program, func);
}

Plan undecided_plan(const ProgramPtr& program) {
  Plan plan{program, {}};
  for (const graph::FuncPtr& f : program->funcs) {
    auto func = std::make_shared<FuncPlan>();
    for (int d = 0; d < f->dimensions(); ++d)
      func->storage.order.push_back(static_cast<int16_t>(d));
    if (f->is_extern()) {
      func->opacity = Opacity::Extern;
    } else {
      for (int s = 0; s < f->stage_count(); ++s) func->nests.push_back(loops_of_definition(*f, s));
    }
    plan.funcs.push_back(std::move(func));
  }
  return plan;
}

}  // namespace retrograde::planning
