// Consumers are scheduled before their producers, so that a producer can choose among their loops.
//
// Kept legal by construction:
// - a Func is computed at a loop only when all of its uses, through inlined Funcs too, are in that
//   one stage, and neither that loop nor one around it is vectorized;
// - between the store level and the compute level every loop is serial or unrolled;
// - reduction loops keep their order and are never vectorized or parallel;
// - outputs are rounded up or shifted inwards only where their extent allows it.
#include "testing/random_schedule.h"

#include <algorithm>
#include <map>
#include <set>

namespace retrograde::fuzz {

namespace {

using Kind = Directive::Kind;
using Where = Placement::Where;

constexpr int unknown = -1;
constexpr int max_inlined_reads = 40;
constexpr int max_unrolled = 8;

struct Loop {
  std::string name;
  int extent = unknown;  // when constant
  bool is_reduction = false;
  bool is_original = true;
  ForType type = ForType::Serial;
};

struct StageLoops {
  std::vector<Loop> loops;  // innermost first
};

class Scheduler {
 public:
  Scheduler(const PipelineSpec& pipeline, uint64_t seed)
      : pipeline_(pipeline), random_(seed + 77) {}

  ScheduleSpec run() {
    const int count = static_cast<int>(pipeline_.funcs.size());
    schedule_.funcs.resize(count);
    loops_.resize(count);
    sites_.resize(count);
    is_inlined_.assign(count, false);
    const std::vector<bool> reachable = reachable_funcs(pipeline_);
    for (const OutputSpec& output : pipeline_.outputs) outputs_[output.func] = &output;
    for (int f = count - 1; f >= 0; --f) {
      schedule_.funcs[f].stages.resize(1 + pipeline_.funcs[f].updates.size());
      if (reachable[f]) schedule_func(f);
    }
    return std::move(schedule_);
  }

 private:
  using Site = std::pair<int, int>;  // a Func and its stage

  const FuncSpec& func(int f) const { return pipeline_.funcs[f]; }
  bool is_output(int f) const { return outputs_.count(f) > 0; }
  bool is_pure(int f) const { return func(f).updates.empty(); }

  void schedule_func(int f) {
    find_sites(f);
    choose_placement(f);
    loops_[f].resize(1 + func(f).updates.size());
    for (size_t s = 0; s < loops_[f].size(); ++s) {
      start_loops(f, static_cast<int>(s));
      if (!is_inlined_[f]) schedule_stage(f, static_cast<int>(s));
    }
    schedule_.funcs[f].bounded = is_output(f) && random_.chance(20);
  }

  // ---- where ----

  // Stages in whose loops f is wanted. Consumers that are inlined stand for their own consumers.
  void find_sites(int f) {
    for (int g = f + 1; g < static_cast<int>(pipeline_.funcs.size()); ++g) {
      for (size_t s = 0; s <= func(g).updates.size(); ++s) {
        bool uses = false;
        for_each_term_of_stage(func(g), static_cast<int>(s), [&](const Term& term) {
          uses |= term.action == Action::Func && term.source == f;
        });
        if (!uses || (sites_[g].empty() && !is_output(g))) continue;  // g is not reached
        if (is_inlined_[g]) {
          sites_[f].insert(sites_[g].begin(), sites_[g].end());
        } else {
          sites_[f].insert({g, static_cast<int>(s)});
        }
      }
    }
  }

  int reads_of(int f) const {
    int reads = 1;
    for (size_t s = 0; s <= func(f).updates.size(); ++s) {
      for_each_term_of_stage(func(f), static_cast<int>(s), [&](const Term& term) {
        if (term.action == Action::Func) ++reads;
      });
    }
    return reads;
  }

  void choose_placement(int f) {
    if (is_output(f)) return;
    Placement& placement = schedule_.funcs[f].placement;
    const int choice = random_.below(100);
    // How often the inlined body is repeated grows along chains of inlined Funcs.
    const int cost = reads_of(f) * static_cast<int>(sites_[f].size() + 1);
    if (choice < 30 && inlined_reads_ * cost <= max_inlined_reads && is_pure(f)) {
      placement.where = random_.chance(50) ? Where::Inline : Where::Default;
      inlined_reads_ *= cost;
    } else if (choice < 40 && !is_pure(f) && inlined_reads_ * cost <= max_inlined_reads) {
      placement.where = Where::Default;
      inlined_reads_ *= cost;
    } else if (choice < 75 && place_at(f, placement)) {
      return;
    } else {
      placement.where = Where::Root;
    }
    is_inlined_[f] = placement.where != Where::Root;
  }

  bool place_at(int f, Placement& placement) {
    if (sites_[f].size() != 1) return false;
    const auto [consumer, stage] = *sites_[f].begin();
    const std::vector<Loop>& loops = loops_[consumer][stage].loops;
    std::vector<int> legal;
    for (int i = static_cast<int>(loops.size()) - 1; i >= 0; --i) {
      if (loops[i].type == ForType::Vectorized) break;
      if (is_unique(consumer, stage, loops[i].name)) legal.push_back(i);
    }
    if (legal.empty()) return false;
    const int compute = random_.pick(legal);
    placement.where = Where::At;
    placement.consumer = consumer;
    placement.stage = stage;
    placement.compute_loop = loops[compute].name;
    if (random_.chance(40)) choose_store_level(consumer, stage, compute, placement);
    return true;
  }

  void choose_store_level(int consumer, int stage, int compute, Placement& placement) {
    const std::vector<Loop>& loops = loops_[consumer][stage].loops;
    std::vector<std::string> legal;
    for (size_t i = compute;; ++i) {
      if (i == loops.size()) {
        // Root is outside of whatever loops the consumer itself is computed in.
        if (schedule_.funcs[consumer].placement.where != Where::At) legal.push_back("root");
        break;
      }
      if (static_cast<int>(i) > compute && is_unique(consumer, stage, loops[i].name)) {
        legal.push_back(loops[i].name);
      }
      if (loops[i].type == ForType::Parallel) break;
    }
    if (!legal.empty()) placement.store_loop = random_.pick(legal);
  }

  // A loop level names a Func and a loop, not a stage.
  bool is_unique(int f, int stage, const std::string& name) const {
    for (size_t s = 0; s < loops_[f].size(); ++s) {
      if (static_cast<int>(s) == stage) continue;
      for (const Loop& loop : loops_[f][s].loops) {
        if (loop.name == name) return false;
      }
    }
    return true;
  }

  // ---- loops ----

  void start_loops(int f, int stage) {
    static const char* const dimension_names[] = {"x", "y", "z"};
    std::vector<Loop>& loops = loops_[f][stage].loops;
    if (stage > 0) {
      const auto& domain = func(f).updates[stage - 1].domain;
      for (size_t k = 0; k < domain.size(); ++k) {
        Loop loop{reduction_loop(static_cast<int>(k)), domain[k].extent};
        loop.is_reduction = true;
        loops.push_back(loop);
      }
    }
    for (int d = 0; d < func(f).dimensions; ++d) {
      if (stage > 0) {
        const Index& left = func(f).updates[stage - 1].left[d];
        const bool pure = left.variable == d && left.scale == 1 && left.divisor == 1 &&
                          left.offset == 0 && !left.clamped && left.data.empty();
        if (!pure) continue;
      }
      loops.push_back({dimension_names[d]});
    }
  }

  void schedule_stage(int f, int stage) {
    std::vector<Loop>& loops = loops_[f][stage].loops;
    if (loops.empty()) return;
    const int splits = random_.below(4);
    for (int i = 0; i < splits; ++i) split(f, stage, random_.below(static_cast<int>(loops.size())));
    if (random_.chance(20)) fuse(f, stage);
    if (random_.chance(50)) reorder(f, stage);
    if (random_.chance(60)) vectorize(f, stage);
    if (random_.chance(30)) unroll(f, stage);
    if (random_.chance(40)) parallelize(f, stage);
  }

  void add(int f, int stage, Directive directive) {
    schedule_.funcs[f].stages[stage].directives.push_back(std::move(directive));
  }

  std::string fresh(const std::string& prefix) { return prefix + std::to_string(++names_); }

  void split(int f, int stage, int at) {
    std::vector<Loop>& loops = loops_[f][stage].loops;
    const Loop old = loops[at];
    const int factor = random_.pick(std::vector<int>{2, 3, 4, 4, 5, 8, 8, 16});
    const TailStrategy tail = choose_tail(f, stage, old, factor);
    const std::string stem = old.name.substr(0, 1);
    Loop outer = old, inner = old;
    outer.is_original = inner.is_original = false;
    outer.name = fresh(stem + "o");
    inner.name = fresh(stem + "i");
    outer.extent = old.extent == unknown ? unknown : (old.extent + factor - 1) / factor;
    inner.extent = factor;
    if (old.is_reduction) {  // names of reduction loops say so
      outer.name = "r" + outer.name;
      inner.name = "r" + inner.name;
    }
    add(f, stage, {Kind::Split, {old.name, outer.name, inner.name}, factor, tail});
    loops[at] = outer;
    loops.insert(loops.begin() + at, inner);
  }

  TailStrategy choose_tail(int f, int stage, const Loop& loop, int factor) {
    std::vector<TailStrategy> legal = {TailStrategy::GuardWithIf, TailStrategy::GuardWithIf,
                                       TailStrategy::Predicate};
    if (!loop.is_original) return random_.pick(legal);
    if (loop.is_reduction || stage > 0) legal.push_back(TailStrategy::Auto);
    if (loop.is_reduction || stage > 0) return random_.pick(legal);
    const int extent = output_extent(f, loop.name);
    if (extent == unknown || extent >= factor) {
      legal.insert(legal.end(), {TailStrategy::ShiftInwards, TailStrategy::Auto});
    }
    if (extent == unknown || extent % factor == 0) {
      legal.insert(legal.end(), {TailStrategy::RoundUp, TailStrategy::RoundUp,
                                 TailStrategy::PredicateLoads, TailStrategy::PredicateStores});
    }
    return random_.pick(legal);
  }

  // The known extent of an original loop of an output's pure definition.
  int output_extent(int f, const std::string& name) const {
    const auto it = outputs_.find(f);
    if (it == outputs_.end()) return unknown;
    const int d = name[0] - 'x';
    int extent = unknown;
    for (const OutputSpec& output : pipeline_.outputs) {
      if (output.func == f) {
        extent = extent == unknown ? output.extents[d] : std::min(extent, output.extents[d]);
      }
    }
    return extent;
  }

  void fuse(int f, int stage) {
    std::vector<Loop>& loops = loops_[f][stage].loops;
    if (loops.size() < 2) return;
    const int at = random_.below(static_cast<int>(loops.size()) - 1);
    const Loop inner = loops[at], outer = loops[at + 1];
    if (inner.is_reduction != outer.is_reduction) return;
    Loop fused = inner;
    fused.is_original = false;
    fused.name = (fused.is_reduction ? "r" : "") + fresh("t");
    fused.extent =
        inner.extent == unknown || outer.extent == unknown ? unknown : inner.extent * outer.extent;
    add(f, stage, {Kind::Fuse, {inner.name, outer.name, fused.name}});
    loops[at] = fused;
    loops.erase(loops.begin() + at + 1);
  }

  void reorder(int f, int stage) {
    std::vector<Loop>& loops = loops_[f][stage].loops;
    if (loops.size() < 2) return;
    std::vector<Loop> shuffled = loops;
    for (size_t i = shuffled.size() - 1; i > 0; --i) {
      std::swap(shuffled[i], shuffled[random_.below(static_cast<int>(i) + 1)]);
    }
    // The reduction loops go back into their order, in the places where such loops landed.
    auto next = loops.begin();
    for (Loop& loop : shuffled) {
      if (!loop.is_reduction) continue;
      next = std::find_if(next, loops.end(), [](const Loop& l) { return l.is_reduction; });
      loop = *next++;
    }
    loops = shuffled;
    Directive directive{Kind::Reorder, {}};
    for (const Loop& loop : loops) directive.loops.push_back(loop.name);
    add(f, stage, directive);
  }

  void vectorize(int f, int stage) {
    std::vector<Loop>& loops = loops_[f][stage].loops;
    std::vector<int> candidates;
    for (size_t i = 0; i < loops.size(); ++i) {
      const bool fits =
          loops[i].extent == unknown || (loops[i].extent > 1 && loops[i].extent <= 16);
      if (!loops[i].is_reduction && fits) candidates.push_back(static_cast<int>(i));
    }
    if (candidates.empty()) return;
    int at = random_.pick(candidates);
    if (loops[at].extent == unknown) split(f, stage, at);  // the inner loop is now at `at`
    loops[at].type = ForType::Vectorized;
    add(f, stage, {Kind::Vectorize, {loops[at].name}});
  }

  void unroll(int f, int stage) {
    std::vector<Loop>& loops = loops_[f][stage].loops;
    const int at = random_.below(static_cast<int>(loops.size()));
    Loop& loop = loops[at];
    if (loop.type != ForType::Serial) return;
    if (loop.extent == unknown) {
      if (!loop.is_original || stage > 0) return;
      split(f, stage, at);
    }
    if (loops[at].extent > max_unrolled) return;
    loops[at].type = ForType::Unrolled;
    add(f, stage, {Kind::Unroll, {loops[at].name}});
  }

  void parallelize(int f, int stage) {
    std::vector<Loop>& loops = loops_[f][stage].loops;
    Loop& loop =
        random_.chance(70) ? loops.back() : loops[random_.below(static_cast<int>(loops.size()))];
    if (loop.type != ForType::Serial || loop.is_reduction) return;
    loop.type = ForType::Parallel;
    add(f, stage, {Kind::Parallel, {loop.name}});
  }

  const PipelineSpec& pipeline_;
  Random random_;
  ScheduleSpec schedule_;
  std::vector<std::vector<StageLoops>> loops_;
  std::vector<std::set<Site>> sites_;
  std::vector<bool> is_inlined_;
  std::map<int, const OutputSpec*> outputs_;
  int inlined_reads_ = 1;
  int names_ = 0;
};

// ---- applying ----

VarOrRVar loop_of(const std::string& name, const RDom& domain) {
  if (!is_reduction_loop(name)) return Var(name);
  const bool is_original = name.size() == 2 && name[1] >= '0' && name[1] <= '9';
  if (is_original) return domain[name[1] - '0'];
  return RVar(name);
}

void apply_directive(const Directive& directive, Stage stage, const RDom& domain) {
  std::vector<VarOrRVar> loops;
  for (const std::string& name : directive.loops) loops.push_back(loop_of(name, domain));
  switch (directive.kind) {
    case Kind::Split:
      stage.split(loops[0], loops[1], loops[2], directive.factor, directive.tail);
      break;
    case Kind::Fuse:
      stage.fuse(loops[0], loops[1], loops[2]);
      break;
    case Kind::Reorder:
      stage.reorder(loops);
      break;
    case Kind::Vectorize:
      stage.vectorize(loops[0]);
      break;
    case Kind::Unroll:
      stage.unroll(loops[0]);
      break;
    case Kind::Parallel:
      stage.parallel(loops[0]);
      break;
  }
}

LoopLevel level_at(const Placement& placement, const std::string& loop,
                   const BuiltPipeline& built) {
  if (loop == "root") return LoopLevel::root();
  const Func& consumer = built.funcs[placement.consumer];
  const RDom domain =
      placement.stage == 0 ? RDom() : built.domains[placement.consumer][placement.stage - 1];
  return LoopLevel(consumer, loop_of(loop, domain));
}

void apply_placement(const Placement& placement, Func& func, const BuiltPipeline& built) {
  switch (placement.where) {
    case Where::Default:
      break;
    case Where::Inline:
      func.compute_inline();
      break;
    case Where::Root:
      func.compute_root();
      break;
    case Where::At:
      if (!placement.store_loop.empty()) {
        func.store_at(level_at(placement, placement.store_loop, built));
      }
      func.compute_at(level_at(placement, placement.compute_loop, built));
      break;
  }
}

}  // namespace

std::string reduction_loop(int k) { return "r" + std::to_string(k); }
bool is_reduction_loop(const std::string& name) { return name[0] == 'r'; }

const char* tail_name(TailStrategy tail) {
  switch (tail) {
    case TailStrategy::RoundUp:
      return "RoundUp";
    case TailStrategy::GuardWithIf:
      return "GuardWithIf";
    case TailStrategy::Predicate:
      return "Predicate";
    case TailStrategy::PredicateLoads:
      return "PredicateLoads";
    case TailStrategy::PredicateStores:
      return "PredicateStores";
    case TailStrategy::ShiftInwards:
      return "ShiftInwards";
    case TailStrategy::Auto:
      break;
  }
  return "Auto";
}

ScheduleSpec default_schedule(const PipelineSpec& pipeline) {
  ScheduleSpec schedule;
  schedule.funcs.resize(pipeline.funcs.size());
  for (size_t f = 0; f < pipeline.funcs.size(); ++f) {
    schedule.funcs[f].stages.resize(1 + pipeline.funcs[f].updates.size());
  }
  return schedule;
}

ScheduleSpec random_schedule(const PipelineSpec& pipeline, uint64_t seed) {
  return Scheduler(pipeline, seed).run();
}

void apply(const ScheduleSpec& schedule, const PipelineSpec& pipeline, BuiltPipeline& built) {
  for (size_t f = 0; f < built.funcs.size(); ++f) {
    const FuncScheduleSpec& spec = schedule.funcs[f];
    Func& func = built.funcs[f];
    for (size_t s = 0; s < spec.stages.size(); ++s) {
      const RDom domain = s == 0 ? RDom() : built.domains[f][s - 1];
      for (const Directive& directive : spec.stages[s].directives) {
        apply_directive(directive, func.stage(static_cast<int>(s)), domain);
      }
    }
    for (const OutputSpec& output : pipeline.outputs) {
      if (!spec.bounded || output.func != static_cast<int>(f)) continue;
      for (int d = 0; d < func.dimensions(); ++d) {
        func.bound(built.vars[d], output.mins[d], output.extents[d]);
      }
    }
  }
  // Loop levels name loops, so the loops come first.
  for (size_t f = 0; f < built.funcs.size(); ++f) {
    apply_placement(schedule.funcs[f].placement, built.funcs[f], built);
  }
}

}  // namespace retrograde::fuzz
