// Draws random schedules. Consumers are scheduled before their producers, so that a producer can choose among their
// loops.
//
// Schedules are legal by construction:
// - a Func is computed at a loop only if all of its uses, also through inlined Funcs, are inside of it, and neither that
//   loop nor one around it is vectorized; with specializations, this holds in each;
// - no loop between the storage level and the compute level is parallel or vectorized;
// - sizes are promised for outputs only, whose sizes are known.
#include "testing/random_schedule.h"

#include <algorithm>

#include "frontend/data/param.h"
#include "graph/directives/directive.h"
#include "graph/names.h"
#include "testing/schedules/derived_funcs.h"
#include "testing/schedules/nesting.h"
#include "testing/schedules/storage.h"

namespace retrograde::fuzz {

using namespace graph;

namespace {

constexpr int max_reads_inlined = 40;

Selector random_selector(Choices& random) {
  Param<int> parameter("selector");
  Selector selector;
  selector.value = random.below(3);
  parameter.set(selector.value);
  selector.parameter = parameter;
  return selector;
}

// Draws the directives of all Funcs of a draft.
class Scheduler {
 public:
  Scheduler(Draft& draft, const Selector& selector, const ScheduleStyle& style)
      : draft_(draft),
        funcs_(draft.funcs),
        random_(draft.random),
        selector_(selector),
        style_(style),
        nesting_(draft.funcs) {}

  void run() {
    choose_companion();
    for (const int f : funcs_.consumers_first()) schedule_func(f);
    for (int f = 0; f < funcs_.count(); ++f) add_prefetches(f);
    if (nesting_.companion) join(*nesting_.companion);
  }

 private:
  void add(int f, Directive directive, int stage = -1) {
    draft_.add(f, std::move(directive), stage);
  }

  // ---- each Func ----

  void schedule_func(int f) {
    nesting_.find_sites(f);
    choose_placement(f);
    nesting_.loops[f].resize(funcs_.stages(f));
    for (int s = 0; s < funcs_.stages(f); ++s) schedule_stage(f, s);
    if (funcs_.is_output(f)) {
      choose_output_rules(draft_, f);
    } else if (!nesting_.is_inlined(f)) {
      choose_storage(draft_, f, nesting_.placements[f], nesting_.is_shared(f));
    }
    if (!random_.chance(5)) return;
    add(f, TraceLoads{});
    add(f, TraceStores{});
    add(f, TraceRealizations{});
  }

  void schedule_stage(int f, int stage) {
    const Loops loops = loops_of(funcs_.func(f), stage);
    LoopVariants& result = nesting_.loops[f][stage];
    if (stage == 0 && nesting_.is_shared(f)) {
      result = {shared_loops_};
      for (const Directive& directive : shared_directives_) add(f, directive, 0);
    } else if (nesting_.is_inlined(f)) {
      result = {loops};
    } else {
      result = schedule_loops(loops, context_of(f, stage), selector_,
                              {funcs_.name(f), stage, {}, {}}, random_, draft_.names, draft_.log);
    }
  }

  StageContext context_of(int f, int stage) const {
    StageContext context;
    context.is_update = stage > 0;
    context.is_associative = is_associative_update(funcs_.func(f), stage);
    context.may_specialize = !nesting_.is_shared(f);
    if (!funcs_.is_output(f)) return context;
    context.output_extents.resize(funcs_.dimensions(f));
    for (const oracle::Region& region : funcs_.regions_of(f)) {
      for (int d = 0; d < funcs_.dimensions(f); ++d)
        context.output_extents[d].push_back(region.extents[d]);
    }
    return context;
  }

  // ---- prefetching ----

  // Prefetches Funcs that are stored at root, and images.
  void add_prefetches(int f) {
    if (nesting_.is_inlined(f)) return;
    for (int s = nesting_.is_shared(f) ? 1 : 0; s < funcs_.stages(f); ++s) {
      std::vector<std::string> sources;
      funcs_.for_each_read(f, s, [&](int p, const ir::Call& call, bool direct) {
        if (direct && (p < 0 || nesting_.placements[p].where == Where::Root))
          sources.push_back(without_numbers(call.name));
      });
      if (!sources.empty() && random_.chance(12)) prefetch(f, s, random_.pick(sources));
    }
  }

  void prefetch(int f, int stage, const std::string& source) {
    std::vector<std::string> candidates;
    for (const Loop& loop : nesting_.loops[f][stage][0]) {
      if (loop.type == ForType::Serial || loop.type == ForType::Parallel)
        candidates.push_back(loop.name);
    }
    if (candidates.empty()) return;
    const size_t at = random_.below(static_cast<int>(candidates.size()));
    const size_t from = random_.chance(60) ? at : candidates.size() - 1;
    add(f, PrefetchData{source, candidates[at], candidates[from], random_.between(1, 3)}, stage);
  }

  // ---- loop fusion (compute_with) ----

  void choose_companion() {
    if (!random_.chance(15)) return;
    for (int f = 0; f < funcs_.count(); ++f) {
      for (int g = 0; g < f; ++g) {
        const bool fits = funcs_.dimensions(f) > 0 && funcs_.func(f).args == funcs_.func(g).args &&
                          !funcs_.depends(f, g) && !funcs_.depends(g, f);
        if (fits) return share_loops(f, g);
      }
    }
  }

  // Gives both stages the same loops, which suit outputs of any extent.
  void share_loops(int f, int g) {
    shared_loops_ = loops_of(funcs_.func(f), 0);
    Loop& outermost = shared_loops_.back();
    if (random_.chance(40)) {
      const std::string outer = draft_.names.fresh("co"), inner = draft_.names.fresh("ci");
      shared_directives_.push_back(SplitLoop{outermost.name, outer, inner, random_.between(2, 5),
                                             TailStrategy::GuardWithIf});
      outermost.name = inner;
      shared_loops_.push_back({outer});
    }
    if (random_.chance(40)) {
      shared_loops_.back().type = ForType::Parallel;
      shared_directives_.push_back(RunLoop{shared_loops_.back().name, ForType::Parallel});
    }
    nesting_.companion = {f, g, random_.pick(shared_loops_).name};
  }

  void join(const Companion& c) {
    ComputeWith with{{{graph::LoopLevel::Kind::At, funcs_.name(c.with), c.loop, 0}}};
    const auto align = static_cast<LoopAlignStrategy>(random_.below(4));
    if (align != LoopAlignStrategy::Auto) {
      for (const Loop& loop : shared_loops_) with.align.emplace_back(loop.name, align);
    }
    add(c.func, with, 0);
  }

  // ---- compute and storage levels ----

  void choose_placement(int f) {
    if (funcs_.is_output(f)) return;
    const int choice = random_.below(100);
    const bool is_pure = funcs_.is_pure(f), is_shared = nesting_.is_shared(f);
    // The number of copies of the inlined body grows along chains of inlined Funcs.
    const int cost = funcs_.reads_of(f) * static_cast<int>(nesting_.sites_of(f).size() + 1);
    const bool inlines = choice < (is_pure ? style_.inlined : style_.inlined / 3) && !is_shared &&
                         inlined_reads_ * cost <= max_reads_inlined;
    if (inlines) {
      nesting_.placements[f].where = Where::Inlined;
      inlined_reads_ *= cost;
      if (is_pure && random_.chance(50)) add(f, ComputeAt{});
    } else if (choice < style_.inlined + style_.at && !is_shared && place_at(f)) {
      return;
    } else {
      add(f, ComputeAt{{root}});
    }
  }

  static inline const graph::LoopLevel root{graph::LoopLevel::Kind::Root, "", "", -1};
  graph::LoopLevel loop_level(const Level& level) const {
    if (level.func < 0) return root;
    return {graph::LoopLevel::Kind::At, funcs_.name(level.func), level.name, -1};
  }

  bool place_at(int f) {
    if (nesting_.sites_of(f).empty()) return false;
    const std::vector<Level> around = nesting_.levels_around(*nesting_.sites_of(f).begin());
    std::vector<int> legal;
    for (size_t i = 0; i < around.size(); ++i) {
      const bool is_legal =
          nesting_.is_legal_level(around[i]) && nesting_.is_around_all_sites(around[i], f);
      if (is_legal && nesting_.nesting_of(f, around[i]) <= style_.most_nested)
        legal.push_back(static_cast<int>(i));
    }
    if (legal.empty()) return false;
    const int compute = random_.pick(legal);
    nesting_.placements[f].where = Where::At;
    nesting_.placements[f].compute = around[compute];
    if (random_.chance(style_.stored_outside)) choose_store_level(f, around, compute);
    add(f, ComputeAt{{loop_level(around[compute])}});
    return true;
  }

  void choose_store_level(int f, const std::vector<Level>& around, int compute) {
    std::vector<Level> legal;
    bool open = true;  // up to the first loop that is not serial
    for (size_t i = compute; i < around.size() && open; ++i) {
      if (static_cast<int>(i) > compute && nesting_.is_legal_level(around[i]))
        legal.push_back(around[i]);
      open = nesting_.runs_in_order(around[i]);
    }
    if (open) legal.push_back({});
    if (legal.empty()) return;
    const int store = random_.below(static_cast<int>(legal.size()));
    nesting_.placements[f].stored_outside = true;
    if (random_.chance(50)) {
      const int hoist = random_.between(store, static_cast<int>(legal.size()) - 1);
      add(f, HoistStorage{{loop_level(legal[hoist])}});
      if (hoist > store && random_.chance(90)) {
        add(f, RingBuffer{random_.between(1, 4)});
        nesting_.placements[f].in_ring = true;
      }
    }
    add(f, StoreAt{{loop_level(legal[store])}});
  }

  Draft& draft_;
  const ProgramFuncs& funcs_;
  Choices& random_;
  const Selector& selector_;
  const ScheduleStyle style_;
  Nesting nesting_;
  Loops shared_loops_;
  std::vector<Directive> shared_directives_;
  int inlined_reads_ = 1;
};

}  // namespace

ScheduleStyle ScheduleStyle::windows() {
  return {.inlined = 8, .at = 82, .stored_outside = 85, .most_nested = 6};
}

ScheduleLog random_schedule(const RandomProgram& program, Choices& choices,
                            const ScheduleStyle& style) {
  const Selector selector = random_selector(choices);
  Draft draft{choices, ProgramFuncs(program, {})};
  if (choices.chance(50)) derive_funcs(draft, program);
  Scheduler(draft, selector, style).run();
  return std::move(draft.log);
}

}  // namespace retrograde::fuzz
