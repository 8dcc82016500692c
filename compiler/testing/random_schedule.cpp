// Consumers are scheduled before their producers, so that a producer can choose among their loops.
//
// Kept legal by construction:
// - a Func is computed at a loop only when all of its uses, through inlined Funcs too, are inside
//   of it, and neither that loop nor one around it is vectorized; with specializations, in each;
// - between the storage level and the compute level no loop is parallel or vectorized;
// - what is known of sizes is said only of outputs, whose sizes are known.
#include "testing/random_schedule.h"

#include <algorithm>
#include <map>
#include <set>

#include "diagnostics/error.h"
#include "testing/apply_schedule.h"
#include "testing/derived_funcs.h"

namespace retrograde::fuzz {

namespace {

using Kind = Directive::Kind;
using Where = Placement::Where;
using Rule = DimensionRule::Kind;

constexpr int max_reads_inlined = 40;
constexpr int ample_storage = 1024;  // more than any dimension ever needs

// A loop by the Func and stage that it belongs to.
struct Level {
  int func = 0, stage = 0;
  std::string name;
  bool operator==(const Level&) const = default;
};

class Scheduler {
 public:
  Scheduler(const PipelineSpec& pipeline, uint64_t seed) : random_(seed + 77) {
    if (random_.chance(50)) schedule_.derived = random_derived_funcs(pipeline, random_, names_);
    extended_ = extend(pipeline, schedule_.derived);
    if (!extended_.loops.empty()) correct_loops(pipeline);
  }

  ScheduleSpec run() {
    schedule_.selector = random_.below(3);
    schedule_.funcs.resize(count());
    loops_.resize(count());
    sites_.resize(count());
    is_inlined_.assign(count(), false);
    reachable_ = reachable_funcs(extended_.pipeline);
    for (int f = 0; f < count(); ++f) {
      schedule_.funcs[f].stages.resize(1 + func(f).updates.size());
    }
    choose_companions();
    for (const int f : consumers_first()) schedule_func(f);
    for (int f = 0; f < count(); ++f) add_prefetches(f);
    return std::move(schedule_);
  }

 private:
  using Site = std::pair<int, int>;  // a Func and its stage

  int count() const { return static_cast<int>(extended_.pipeline.funcs.size()); }
  const FuncSpec& func(int f) const { return extended_.pipeline.funcs[f]; }
  int stages(int f) const { return 1 + static_cast<int>(func(f).updates.size()); }
  bool is_pure(int f) const { return func(f).updates.empty(); }
  bool is_output(int f) const {
    for (const OutputSpec& output : extended_.pipeline.outputs) {
      if (output.func == f) return true;
    }
    return false;
  }

  std::set<int> producers_of_stage(int f, int stage) const {
    std::set<int> producers;
    for_each_term_of_stage(func(f), stage, [&](const Term& term) {
      if (term.action == Action::Func) producers.insert(term.source);
    });
    return producers;
  }
  std::set<int> producers_of(int f) const {
    std::set<int> producers;
    for (int s = 0; s < stages(f); ++s) producers.merge(producers_of_stage(f, s));
    return producers;
  }

  std::vector<int> consumers_first() const {
    std::vector<int> order, waiting(count(), 0);
    for (int f = 0; f < count(); ++f) {
      if (!reachable_[f]) continue;
      for (const int p : producers_of(f)) ++waiting[p];
    }
    for (int f = count() - 1; f >= 0; --f) {
      if (reachable_[f] && waiting[f] == 0) order.push_back(f);
    }
    for (size_t i = 0; i < order.size(); ++i) {
      for (const int p : producers_of(order[i])) {
        if (--waiting[p] == 0) order.push_back(p);
      }
    }
    return order;
  }

  void schedule_func(int f) {
    find_sites(f);
    choose_placement(f);
    loops_[f].resize(stages(f));
    for (int s = 0; s < stages(f); ++s) schedule_stage(f, s);
    if (is_output(f)) {
      choose_output_rules(f);
    } else if (!is_inlined_[f]) {
      choose_storage(f);
    }
    schedule_.funcs[f].traced = random_.chance(5);
  }

  // ---- loops ----

  // Which loops the two halves of a factored update have, and in which order, the Funcs tell.
  void correct_loops(const PipelineSpec& pipeline) {
    ScheduleSpec only_derived = default_schedule(pipeline);
    only_derived.derived = schedule_.derived;
    only_derived.funcs.resize(count());
    BuiltPipeline built = build(pipeline);
    try {
      apply(only_derived, built);
    } catch (const UserError&) {
      return;  // the program will be refused
    }
    const int first = count() - static_cast<int>(schedule_.derived.size());
    for (size_t i = 0; i < schedule_.derived.size(); ++i) {
      const DerivedFunc& derived = schedule_.derived[i];
      if (derived.kind != DerivedFunc::Kind::Factored) continue;
      const RDom& domain = built.domains[derived.source][derived.stage - 1];
      const int id = first + static_cast<int>(i);
      for (const Site& site : {Site{derived.source, derived.stage}, Site{id, 0}, Site{id, 1}}) {
        const Stage stage = built.funcs[site.first].stage(site.second);
        extended_.loops[site] = as_ordered(stage, domain, extended_.loops[site]);
      }
    }
  }

  static Loops as_ordered(const Stage& stage, const RDom& domain, const Loops& known) {
    Loops result;
    for (const ir::Dim& dim : stage.get_schedule().dims) {
      for (const Loop& loop : known) {
        const bool is_variable = is_reduction_variable(loop.name);
        const std::string name = is_variable ? domain[loop.name[1] - '0'].name() : loop.name;
        if (name == dim.var) result.push_back(loop);
      }
    }
    return result;
  }

  void schedule_stage(int f, int stage) {
    const auto given = extended_.loops.find({f, stage});
    Loops loops = given != extended_.loops.end() ? given->second : initial_loops(func(f), stage);
    std::vector<Directive>& directives = schedule_.funcs[f].stages[stage].directives;
    if (stage == 0 && companions_.count(f)) {
      loops_[f][stage].variants = {companions_[f].loops};
      directives = companions_[f].directives;
    } else if (is_inlined_[f]) {
      loops_[f][stage].variants = {loops};
    } else {
      if (given != extended_.loops.end()) directives.push_back(order_of(loops));
      loops_[f][stage] = schedule_loops(loops, context_of(f, stage), schedule_.selector, random_,
                                        names_, directives);
    }
  }

  static Directive order_of(const Loops& loops) {
    Directive directive{Kind::Reorder, {}};
    for (const Loop& loop : loops) directive.loops.push_back(loop.name);
    return directive;
  }

  StageContext context_of(int f, int stage) const {
    StageContext context;
    context.is_update = stage > 0;
    context.is_associative = is_associative_update(func(f), stage);
    context.may_specialize = !companions_.count(f);
    if (!is_output(f)) return context;
    context.output_extents.resize(func(f).dimensions);
    for (const auto& run : all_runs(extended_.pipeline)) {
      for (const OutputSpec& output : run) {
        if (output.func != f) continue;
        for (int d = 0; d < func(f).dimensions; ++d) {
          context.output_extents[d].push_back(output.extents[d]);
        }
      }
    }
    return context;
  }

  // Of Funcs that are stored as a whole, and of images.
  void add_prefetches(int f) {
    if (!reachable_[f] || is_inlined_[f]) return;
    for (int s = 0; s < stages(f); ++s) {
      if (companions_.count(f) && s == 0) continue;
      std::vector<int> sources;
      for_each_term_of_stage(func(f), s, [&](const Term& term) {
        if (term.action == Action::Image &&
            extended_.pipeline.images[term.source].boundary == Boundary::Clamp) {
          sources.push_back(-1 - term.source);
        }
        if (term.action == Action::Func &&
            schedule_.funcs[term.source].placement.where == Where::Root) {
          sources.push_back(term.source);
        }
      });
      if (!sources.empty() && random_.chance(12)) prefetch(f, s, random_.pick(sources));
    }
  }

  void prefetch(int f, int stage, int source) {
    std::vector<std::string> candidates;
    for (const Loop& loop : loops_[f][stage].variants[0]) {
      const bool runs = loop.type == ForType::Serial || loop.type == ForType::Parallel;
      if (runs && !loop.name.empty()) candidates.push_back(loop.name);
    }
    if (candidates.empty()) return;
    const size_t at = random_.below(static_cast<int>(candidates.size()));
    const size_t from = random_.chance(60) ? at : candidates.size() - 1;
    Directive directive{Kind::Prefetch, {candidates[at], candidates[from]}};
    directive.factor = random_.between(1, 3);
    directive.source = source;
    schedule_.funcs[f].stages[stage].directives.push_back(std::move(directive));
  }

  // ---- stages that share loops ----

  struct SharedLoops {
    Loops loops;
    std::vector<Directive> directives;
  };

  bool depends(int f, int on) const {
    for (const int p : producers_of(f)) {
      if (p == on || depends(p, on)) return true;
    }
    return false;
  }

  void choose_companions() {
    if (!random_.chance(15)) return;
    for (int f = 0; f < count(); ++f) {
      for (int g = 0; g < f; ++g) {
        const bool fits = reachable_[f] && reachable_[g] && func(f).dimensions > 0 &&
                          func(f).dimensions == func(g).dimensions && !depends(f, g) &&
                          !depends(g, f) && !extended_.loops.count({f, 0}) &&
                          !extended_.loops.count({g, 0});
        if (fits) return share_loops(f, g);
      }
    }
  }

  // Both get the same loops, which suit outputs of any extent.
  void share_loops(int f, int g) {
    SharedLoops shared;
    shared.loops = initial_loops(func(f), 0);
    const auto add = [&](Directive directive) { shared.directives.push_back(directive); };
    Loop& outermost = shared.loops.back();
    if (random_.chance(40)) {
      const std::string outer = names_.fresh("co"), inner = names_.fresh("ci");
      add({Kind::Split,
           {outermost.name, outer, inner},
           random_.between(2, 5),
           TailStrategy::GuardWithIf});
      outermost.name = inner;
      shared.loops.push_back({outer});
    }
    if (random_.chance(40)) {
      shared.loops.back().type = ForType::Parallel;
      add({Kind::Parallel, {shared.loops.back().name}});
    }
    Companion companion{f, g};
    companion.loop = random_.pick(shared.loops).name;
    companion.align = static_cast<LoopAlignStrategy>(random_.below(4));
    schedule_.companions.push_back(companion);
    companions_[f] = companions_[g] = shared;
  }

  // ---- where ----

  // Stages in whose loops f is wanted. Consumers that are inlined stand for their own consumers.
  void find_sites(int f) {
    for (int g = 0; g < count(); ++g) {
      if (!reachable_[g]) continue;
      for (int s = 0; s < stages(g); ++s) {
        if (!producers_of_stage(g, s).count(f)) continue;
        if (is_inlined_[g]) {
          sites_[f].insert(sites_[g].begin(), sites_[g].end());
        } else {
          sites_[f].insert({g, s});
        }
      }
    }
  }

  int reads_of(int f) const {
    int reads = 1;
    for (int s = 0; s < stages(f); ++s) {
      for_each_term_of_stage(func(f), s, [&](const Term& term) {
        if (term.action == Action::Func) ++reads;
      });
    }
    return reads;
  }

  void choose_placement(int f) {
    if (is_output(f)) return;
    Placement& placement = schedule_.funcs[f].placement;
    placement.where = Where::Root;
    if (companions_.count(f)) return;
    const int choice = random_.below(100);
    // How often the inlined body is repeated grows along chains of inlined Funcs.
    const int cost = reads_of(f) * static_cast<int>(sites_[f].size() + 1);
    if (choice < 25 && inlined_reads_ * cost <= max_reads_inlined && is_pure(f)) {
      placement.where = random_.chance(50) ? Where::Inline : Where::Default;
      inlined_reads_ *= cost;
    } else if (choice < 33 && !is_pure(f) && inlined_reads_ * cost <= max_reads_inlined) {
      placement.where = Where::Default;
      inlined_reads_ *= cost;
    } else if (choice < 75) {
      place_at(f, placement);
    }
    is_inlined_[f] = placement.where == Where::Inline || placement.where == Where::Default;
  }

  // The loops around a stage, innermost first: its own, then those around where its Func is
  // computed. Only loops that a level can name.
  std::vector<Level> levels_around(int f, int stage) const {
    std::vector<Level> levels;
    const Companion* shared = stage == 0 ? companion_of_guest(f) : nullptr;
    for (const Loop& loop : loops_[f][stage].variants[0]) {
      if (shared && loop.name == shared->loop) return with_shared_loops(*shared, levels);
      levels.push_back({f, stage, loop.name});
    }
    const Placement& placement = schedule_.funcs[f].placement;
    if (placement.where != Where::At) return levels;
    const std::vector<Level> around = levels_around(placement.consumer, placement.stage);
    const Level at{placement.consumer, placement.stage, placement.compute_loop};
    levels.insert(levels.end(), std::find(around.begin(), around.end(), at), around.end());
    return levels;
  }

  // Of a Func whose outer loops are another's.
  const Companion* companion_of_guest(int f) const {
    for (const Companion& companion : schedule_.companions) {
      if (companion.func == f) return &companion;
    }
    return nullptr;
  }

  // Shared loops are named by the Func that they are of, as far as that one is scheduled already.
  std::vector<Level> with_shared_loops(const Companion& shared, std::vector<Level> levels) const {
    if (loops_[shared.with].empty()) return levels;
    const std::vector<Level> around = levels_around(shared.with, 0);
    const auto first = std::find(around.begin(), around.end(), Level{shared.with, 0, shared.loop});
    levels.insert(levels.end(), first, around.end());
    return levels;
  }

  // Whether something may be computed there, in each of the stage's schedules.
  bool is_legal_level(const Level& level) const {
    if (level.name.empty() || !is_unique(level)) return false;
    for (const Loops& loops : loops_[level.func][level.stage].variants) {
      bool found = false, vectorized = false;
      for (const Loop& loop : loops) {
        found |= loop.name == level.name;
        vectorized |= found && loop.type == ForType::Vectorized;
      }
      if (!found || vectorized) return false;
    }
    return true;
  }

  // A loop level names a Func and a loop, not a stage.
  bool is_unique(const Level& level) const {
    for (int s = 0; s < stages(level.func); ++s) {
      if (s == level.stage) continue;
      for (const Loops& loops : loops_[level.func][s].variants) {
        for (const Loop& loop : loops) {
          if (loop.name == level.name) return false;
        }
      }
    }
    return true;
  }

  void place_at(int f, Placement& placement) {
    if (sites_[f].empty()) return;
    const Site first = *sites_[f].begin();
    const std::vector<Level> around = levels_around(first.first, first.second);
    std::vector<int> legal;
    for (size_t i = 0; i < around.size(); ++i) {
      if (is_legal_level(around[i]) && is_around_all_sites(around[i], f)) {
        legal.push_back(static_cast<int>(i));
      }
    }
    if (legal.empty()) return;
    const int compute = random_.pick(legal);
    placement.where = Where::At;
    placement.consumer = around[compute].func;
    placement.stage = around[compute].stage;
    placement.compute_loop = around[compute].name;
    if (random_.chance(55)) choose_store_level(around, compute, placement);
  }

  bool is_around_all_sites(const Level& level, int f) const {
    return std::all_of(sites_[f].begin(), sites_[f].end(), [&](const Site& site) {
      const std::vector<Level> around = levels_around(site.first, site.second);
      return std::find(around.begin(), around.end(), level) != around.end();
    });
  }

  void choose_store_level(const std::vector<Level>& around, int compute, Placement& placement) {
    static const Level root{-1, 0, "root"};
    std::vector<Level> legal;
    bool open = true;  // out to the first loop that is not serial
    for (size_t i = compute; i < around.size() && open; ++i) {
      if (static_cast<int>(i) > compute && is_legal_level(around[i])) legal.push_back(around[i]);
      open = runs_in_order(around[i]);
    }
    if (open) legal.push_back(root);
    if (legal.empty()) return;
    const int store = random_.below(static_cast<int>(legal.size()));
    placement.store_loop = legal[store].name;
    placement.store_consumer = legal[store].func;
    placement.store_stage = legal[store].stage;
    if (!random_.chance(20)) return;
    const Level& hoist = legal[random_.between(store, static_cast<int>(legal.size()) - 1)];
    placement.hoist_loop = hoist.name;
    placement.hoist_consumer = hoist.func;
    placement.hoist_stage = hoist.stage;
  }

  // Specializations may order loops in other ways: then not known.
  bool runs_in_order(const Level& level) const {
    const std::vector<Loops>& variants = loops_[level.func][level.stage].variants;
    if (variants.size() > 1) return false;
    return std::all_of(variants[0].begin(), variants[0].end(), [&](const Loop& loop) {
      return loop.name != level.name || loop.type == ForType::Serial ||
             loop.type == ForType::Unrolled;
    });
  }

  // ---- storage and sizes ----

  int random_dimension(int f) { return random_.below(func(f).dimensions); }

  void choose_storage(int f) {
    FuncScheduleSpec& spec = schedule_.funcs[f];
    if (random_.chance(10)) spec.memory = MemoryType::Heap;
    const bool stored_outside = !spec.placement.store_loop.empty();
    if (!stored_outside && random_.chance(8)) spec.memoized = true;
    if (!spec.memoized && random_.chance(8)) spec.async = true;
    if (companions_.count(f)) spec.memoized = spec.async = false;
    if (func(f).dimensions == 0) return;
    const auto add = [&](Rule kind, int a, int b = 0) {
      spec.rules.push_back({kind, random_dimension(f), a, b});
    };
    if (!spec.memoized && random_.chance(12))
      add(Rule::AlignStorage, random_.pick(std::vector<int>{2, 4, 16, 5}));
    if (!spec.memoized && random_.chance(4)) add(Rule::BoundStorage, ample_storage);
    if (stored_outside && random_.chance(20)) {
      add(Rule::FoldStorage, random_.pick(std::vector<int>{64, 128, 256}), 1);
    }
    if (random_.chance(8)) {
      const int modulus = random_.between(2, 5);
      add(Rule::AlignBounds, modulus, random_.below(modulus));
    }
    if (random_.chance(5)) add(Rule::AlignExtent, random_.between(2, 5));
    if (func(f).dimensions > 1 && random_.chance(15)) reorder_storage(f);
  }

  void reorder_storage(int f) {
    std::vector<int>& order = schedule_.funcs[f].storage_order;
    for (int d = 0; d < std::min(func(f).dimensions, 3); ++d) order.push_back(d);
    for (size_t i = order.size() - 1; i > 0; --i) {
      std::swap(order[i], order[random_.below(static_cast<int>(i) + 1)]);
    }
  }

  // Promises about an output hold for each region that it is computed over.
  void choose_output_rules(int f) {
    const auto runs = all_runs(extended_.pipeline);
    if (runs.size() > 1 || !random_.chance(25)) return;
    for (const OutputSpec& output : runs[0]) {
      if (output.func != f) continue;
      for (int d = 0; d < func(f).dimensions; ++d) {
        schedule_.funcs[f].rules.push_back(promise(d, output.mins[d], output.extents[d]));
      }
    }
  }

  DimensionRule promise(int d, int min, int extent) {
    if (random_.chance(60)) return {Rule::Bound, d, min, extent};
    if (random_.chance(50)) return {Rule::BoundExtent, d, extent};
    for (int modulus = 5; modulus > 1; --modulus) {
      const int remainder = ((min % modulus) + modulus) % modulus;
      if (extent % modulus == 0) return {Rule::AlignBounds, d, modulus, remainder};
    }
    return {Rule::BoundExtent, d, extent};
  }

  ExtendedPipeline extended_;
  Random random_;
  LoopNames names_;
  ScheduleSpec schedule_;
  std::vector<bool> reachable_;
  std::vector<std::vector<StageLoops>> loops_;
  std::vector<std::set<Site>> sites_;
  std::vector<bool> is_inlined_;
  std::map<int, SharedLoops> companions_;
  int inlined_reads_ = 1;
};

}  // namespace

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

}  // namespace retrograde::fuzz
