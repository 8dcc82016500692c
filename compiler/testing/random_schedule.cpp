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
#include <set>

#include "diagnostics/error.h"
#include "frontend/data/param.h"
#include "graph/directives/directive.h"
#include "graph/directives/wrappers.h"
#include "graph/names.h"
#include "ir/visit.h"
#include "testing/random_loops.h"

namespace retrograde::fuzz {

namespace {

using namespace graph;

constexpr int max_reads_inlined = 40;
constexpr int ample_storage = 1024;  // more than any dimension needs

// A loop, identified by its Func and stage; root: no Func.
struct Level {
  int func = -1, stage = 0;
  std::string name;
  bool operator==(const Level&) const = default;
};

// Where a Func is computed; for At, also the loop.
enum class Where : uint8_t { Inlined, Root, At };
struct Placement {
  Where where = Where::Root;
  Level compute;
  bool stored_outside = false;
  bool in_ring = false;
};

// A Func that shares another Func's loops, from this one outwards.
struct Companion {
  int func = 0, with = 0;
  std::string loop;
};

class Scheduler {
 public:
  Scheduler(const RandomProgram& program, Choices& choices, const ScheduleStyle& style)
      : program_(program), random_(choices), style_(style) {
    Param<int> selector("selector");
    selector_.value = random_.below(3);
    selector.set(selector_.value);
    selector_.parameter = selector;
    find_funcs();
    if (random_.chance(50)) derive();
  }

  ScheduleLog run() {
    loops_.resize(funcs_.size());
    sites_.resize(funcs_.size());
    placements_.resize(funcs_.size());
    choose_companions();
    for (const int f : consumers_first()) schedule_func(f);
    for (int f = 0; f < count(); ++f) add_prefetches(f);
    for (const Companion& c : companions_) join(c);
    return std::move(log_);
  }

 private:
  using Site = std::pair<int, int>;  // a Func and its stage

  // ---- the program as compiled, with wrappers applied ----

  // Finds the Funcs that the outputs need. Funcs of boundary conditions and inline reductions are replaced by the Funcs
  // that they read.
  void find_funcs() {
    compiled_ = apply_wrappers(with_log(log_, outputs_of(program_)));
    std::set<std::string> known;
    for (const Func& f : program_.funcs) known.insert(name_of(*f.function()));
    for (const ScheduleLog::Entry& entry : log_.entries) known.insert(made_by(entry.directive));
    funcs_.clear();
    std::map<std::string, int> alike;  // Funcs with equal names, which a log cannot distinguish
    const std::vector<FuncPtr> all = topological_order(compiled_);
    for (const FuncPtr& f : all) ++alike[name_of(*f)];
    for (const FuncPtr& f : all) {
      if (known.count(name_of(*f)) && alike[name_of(*f)] == 1) funcs_.push_back(f);
    }
  }

  int count() const { return static_cast<int>(funcs_.size()); }
  const FuncContents& func(int f) const { return *funcs_[f]; }
  static std::string name_of(const FuncContents& f) { return without_numbers(f.name); }
  std::string name(int f) const { return name_of(func(f)); }
  int stages(int f) const { return func(f).stage_count(); }
  bool is_pure(int f) const { return func(f).updates.empty(); }
  int dimensions(int f) const { return func(f).dimensions(); }
  bool is_output(int f) const { return std::ranges::find(compiled_, funcs_[f]) != compiled_.end(); }

  // Calls `visit` with each Func, by its number, and each image (-1) that the stage reads. `direct`: the read is the
  // stage's own, not through an unscheduled Func. Each of those is visited once.
  using Seen = std::set<const FuncContents*>;
  template <typename Visit>
  void for_each_read(const FuncContents& f, int stage, const Visit& visit, bool direct = true,
                     Seen&& seen = {}) const {
    walk(f.stage(stage), [&](const Call& call) {
      if (call.symbol.raw() == &f) return;
      if (call.call_type == CallType::Image) visit(-1, call, direct);
      if (call.call_type != CallType::Func) return;
      const FuncPtr callee = func_of(call);
      const auto known = std::find(funcs_.begin(), funcs_.end(), callee);
      if (known != funcs_.end()) {
        visit(static_cast<int>(known - funcs_.begin()), call, direct);
      } else if (seen.insert(callee.get()).second) {
        for (int s = 0; s < callee->stage_count(); ++s)
          for_each_read(*callee, s, visit, false, std::move(seen));
      }
    });
  }
  std::set<int> producers_of_stage(int f, int stage) const {
    std::set<int> producers;
    for_each_read(func(f), stage, [&](int p, const Call&, bool) {
      if (p >= 0) producers.insert(p);
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
      for (const int p : producers_of(f)) ++waiting[p];
    }
    for (int f = count() - 1; f >= 0; --f) {
      if (waiting[f] == 0) order.push_back(f);
    }
    for (size_t i = 0; i < order.size(); ++i) {
      for (const int p : producers_of(order[i])) {
        if (--waiting[p] == 0) order.push_back(p);
      }
    }
    return order;
  }

  void add(int f, Directive directive, int stage = -1) {
    log_.entries.push_back({name(f), stage, {}, std::move(directive)});
  }

  // ---- Funcs generated by directives ----

  void derive() {
    std::set<std::string> wrapped;
    for (int f = 0; f < count(); ++f) {
      if (random_.chance(8)) wrap(f, wrapped);
      if (random_.chance(5)) copy_input(f, wrapped);
    }
    for (int f = 0; f < count(); ++f) {
      // Wrappers are created for consumers by name, which an update that is factored would break.
      for (int s = 1; s < stages(f) && !wrapped.count(name(f)); ++s) {
        if (random_.chance(35)) factor(f, s);
      }
    }
    try {
      find_funcs();
    } catch (const UserError&) {
      log_.entries.clear();
      find_funcs();
    }
  }

  void wrap(int f, std::set<std::string>& wrapped) {
    std::vector<int> users;
    for (int g = 0; g < count(); ++g) {
      const auto callees = direct_callees(func(g));
      if (std::find(callees.begin(), callees.end(), funcs_[f]) != callees.end()) users.push_back(g);
    }
    if (users.empty()) return;
    const bool clones = random_.chance(30), for_all = !clones && random_.chance(40);
    const int user = random_.pick(users);
    const std::string made = names_.fresh("w");
    std::vector<NamedFunc> named;
    if (!for_all) named.emplace_back(name(user));
    wrapped.insert({name(f), name(user)});
    add(f, clones ? Directive(Clone{made, named}) : Directive(Wrap{made, named}));
  }

  void copy_input(int f, std::set<std::string>& wrapped) {
    std::vector<std::string> images;
    walk(func(f), [&](const Call& call) {
      if (call.call_type == CallType::Image) images.push_back(call.name);
    });
    if (images.empty() || func(f).is_extern()) return;
    wrapped.insert(name(f));
    add(f, CopyInput{names_.fresh("w"), NamedFunc(random_.pick(images))});
  }

  void factor(int f, int stage) {
    if (!is_associative_update(func(f), stage)) return;
    Loops loops = loops_of(func(f), stage);
    std::erase_if(loops, [](const Loop& loop) { return !loop.is_reduction; });
    if (loops.empty()) return;
    std::string kept = random_.pick(loops).name;
    if (random_.chance(50)) {
      const SplitLoop split{kept, names_.fresh("rro"), names_.fresh("rri"), random_.between(2, 4)};
      add(f, split, stage);
      kept = random_.chance(50) ? split.outer : split.inner;
    }
    add(f, FactorOut{names_.fresh("p"), {{kept, names_.fresh("u")}}}, stage);
  }

  // ---- each Func ----

  void schedule_func(int f) {
    find_sites(f);
    choose_placement(f);
    loops_[f].resize(stages(f));
    for (int s = 0; s < stages(f); ++s) schedule_stage(f, s);
    if (is_output(f)) {
      choose_output_rules(f);
    } else if (!is_inlined(f)) {
      choose_storage(f);
    }
    if (!random_.chance(5)) return;
    add(f, TraceLoads{});
    add(f, TraceStores{});
    add(f, TraceRealizations{});
  }

  bool is_inlined(int f) const { return placements_[f].where == Where::Inlined; }

  void schedule_stage(int f, int stage) {
    const Loops loops = loops_of(func(f), stage);
    if (stage == 0 && is_shared(f)) {
      loops_[f][stage] = {shared_loops_};
      for (Directive& directive : std::vector(shared_directives_)) add(f, directive, 0);
    } else if (is_inlined(f)) {
      loops_[f][stage] = {loops};
    } else {
      loops_[f][stage] = schedule_loops(loops, context_of(f, stage), selector_,
                                        {name(f), stage, {}, {}}, random_, names_, log_);
    }
  }

  StageContext context_of(int f, int stage) const {
    StageContext context;
    context.is_update = stage > 0;
    context.is_associative = is_associative_update(func(f), stage);
    context.may_specialize = !is_shared(f);
    if (!is_output(f)) return context;
    context.output_extents.resize(dimensions(f));
    for (const oracle::Region& region : regions_of(f)) {
      for (int d = 0; d < dimensions(f); ++d)
        context.output_extents[d].push_back(region.extents[d]);
    }
    return context;
  }

  // The regions of an output, over all runs.
  std::vector<oracle::Region> regions_of(int f) const {
    std::vector<oracle::Region> regions;
    for (size_t o = 0; o < program_.outputs.size(); ++o) {
      if (name_of(*program_.outputs[o].function()) != name(f)) continue;
      for (const auto& run : program_.runs) regions.push_back(run[o]);
    }
    return regions;
  }

  // Prefetches Funcs that are stored at root, and images.
  void add_prefetches(int f) {
    if (is_inlined(f)) return;
    for (int s = is_shared(f) ? 1 : 0; s < stages(f); ++s) {
      std::vector<std::string> sources;
      for_each_read(func(f), s, [&](int p, const Call& call, bool direct) {
        if (direct && (p < 0 || placements_[p].where == Where::Root))
          sources.push_back(without_numbers(call.name));
      });
      if (!sources.empty() && random_.chance(12)) prefetch(f, s, random_.pick(sources));
    }
  }

  void prefetch(int f, int stage, const std::string& source) {
    std::vector<std::string> candidates;
    for (const Loop& loop : loops_[f][stage][0]) {
      if (loop.type == ForType::Serial || loop.type == ForType::Parallel)
        candidates.push_back(loop.name);
    }
    if (candidates.empty()) return;
    const size_t at = random_.below(static_cast<int>(candidates.size()));
    const size_t from = random_.chance(60) ? at : candidates.size() - 1;
    add(f, PrefetchData{source, candidates[at], candidates[from], random_.between(1, 3)}, stage);
  }

  // ---- loop fusion (compute_with) ----

  bool depends(int f, int on) const {
    return std::ranges::any_of(producers_of(f),
                               [&](const int p) { return p == on || depends(p, on); });
  }
  bool is_shared(int f) const {
    return std::any_of(companions_.begin(), companions_.end(),
                       [&](const Companion& c) { return c.func == f || c.with == f; });
  }

  void choose_companions() {
    if (!random_.chance(15)) return;
    for (int f = 0; f < count(); ++f) {
      for (int g = 0; g < f; ++g) {
        const bool fits =
            dimensions(f) > 0 && func(f).args == func(g).args && !depends(f, g) && !depends(g, f);
        if (fits) return share_loops(f, g);
      }
    }
  }

  // Gives both stages the same loops, which suit outputs of any extent.
  void share_loops(int f, int g) {
    shared_loops_ = loops_of(func(f), 0);
    Loop& outermost = shared_loops_.back();
    if (random_.chance(40)) {
      const std::string outer = names_.fresh("co"), inner = names_.fresh("ci");
      shared_directives_.push_back(SplitLoop{outermost.name, outer, inner, random_.between(2, 5),
                                             TailStrategy::GuardWithIf});
      outermost.name = inner;
      shared_loops_.push_back({outer});
    }
    if (random_.chance(40)) {
      shared_loops_.back().type = ForType::Parallel;
      shared_directives_.push_back(RunLoop{shared_loops_.back().name, ForType::Parallel});
    }
    companions_.push_back({f, g, random_.pick(shared_loops_).name});
  }

  void join(const Companion& c) {
    ComputeWith with{{{graph::LoopLevel::Kind::At, name(c.with), c.loop, 0}}};
    const auto align = static_cast<LoopAlignStrategy>(random_.below(4));
    if (align != LoopAlignStrategy::Auto) {
      for (const Loop& loop : shared_loops_) with.align.emplace_back(loop.name, align);
    }
    add(c.func, with, 0);
  }

  // ---- compute and storage levels ----

  // Finds the stages that use f. An inlined consumer is replaced by its own consumers.
  void find_sites(int f) {
    for (int g = 0; g < count(); ++g) {
      for (int s = 0; s < stages(g); ++s) {
        if (!producers_of_stage(g, s).count(f)) continue;
        if (is_inlined(g)) {
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
      for_each_read(func(f), s, [&](int p, const Call&, bool) { reads += p >= 0; });
    }
    return reads;
  }

  void choose_placement(int f) {
    if (is_output(f)) return;
    const int choice = random_.below(100);
    // The number of copies of the inlined body grows along chains of inlined Funcs.
    const int cost = reads_of(f) * static_cast<int>(sites_[f].size() + 1);
    const bool inlines = choice < (is_pure(f) ? style_.inlined : style_.inlined / 3) &&
                         !is_shared(f) && inlined_reads_ * cost <= max_reads_inlined;
    if (inlines) {
      placements_[f].where = Where::Inlined;
      inlined_reads_ *= cost;
      if (is_pure(f) && random_.chance(50)) add(f, ComputeAt{});
    } else if (choice < style_.inlined + style_.at && !is_shared(f) && place_at(f)) {
      return;
    } else {
      add(f, ComputeAt{{root}});
    }
  }

  // The loops around a stage, innermost first: its own, then those around the compute level of its Func. Only loops
  // that a level can name.
  std::vector<Level> levels_around(int f, int stage) const {
    std::vector<Level> levels;
    const Companion* shared = stage == 0 ? companion_of_guest(f) : nullptr;
    for (const Loop& loop : loops_[f][stage][0]) {
      if (shared && loop.name == shared->loop) return with_shared_loops(*shared, levels);
      levels.push_back({f, stage, loop.name});
    }
    const Placement& placement = placements_[f];
    if (placement.where != Where::At) return levels;
    const Level& at = placement.compute;
    const std::vector<Level> around = levels_around(at.func, at.stage);
    levels.insert(levels.end(), std::find(around.begin(), around.end(), at), around.end());
    return levels;
  }

  // The record of a Func that shares another Func's loops.
  const Companion* companion_of_guest(int f) const {
    return ir::first_where(companions_, [&](const Companion& c) { return c.func == f; });
  }

  // Shared loops belong to the other Func; they are known once it is scheduled.
  std::vector<Level> with_shared_loops(const Companion& shared, std::vector<Level> levels) const {
    if (loops_[shared.with].empty()) return levels;
    const std::vector<Level> around = levels_around(shared.with, 0);
    const auto first = std::find(around.begin(), around.end(), Level{shared.with, 0, shared.loop});
    levels.insert(levels.end(), first, around.end());
    return levels;
  }

  // Whether a Func may be computed at the level, in each of the stage's specializations. A loop level names a Func and
  // a loop without a stage, so no other stage may have such a loop.
  bool is_legal_level(const Level& level) const {
    for (int s = 0; s < stages(level.func); ++s) {
      for (const Loops& loops : loops_[level.func][s]) {
        const auto at = std::ranges::find(loops, level.name, &Loop::name);
        if ((s == level.stage) == (at == loops.end())) return false;
        if (std::any_of(at, loops.end(),
                        [](const Loop& loop) { return loop.type == ForType::Vectorized; }))
          return false;
      }
    }
    return true;
  }

  static inline const graph::LoopLevel root{graph::LoopLevel::Kind::Root, "", "", -1};
  graph::LoopLevel loop_level(const Level& level) const {
    if (level.func < 0) return root;
    return {graph::LoopLevel::Kind::At, name(level.func), level.name, -1};
  }

  bool place_at(int f) {
    if (sites_[f].empty()) return false;
    const Site first = *sites_[f].begin();
    const std::vector<Level> around = levels_around(first.first, first.second);
    std::vector<int> legal;
    for (size_t i = 0; i < around.size(); ++i) {
      const bool is_legal = is_legal_level(around[i]) && is_around_all_sites(around[i], f);
      if (is_legal && share_of_nesting(f) + nesting_of(around[i]) <= style_.most_nested)
        legal.push_back(static_cast<int>(i));
    }
    if (legal.empty()) return false;
    const int compute = random_.pick(legal);
    placements_[f].where = Where::At;
    placements_[f].compute = around[compute];
    if (random_.chance(style_.stored_outside)) choose_store_level(f, around, compute);
    add(f, ComputeAt{{loop_level(around[compute])}});
    return true;
  }

  // The weight of a Func in the nesting limit: each enclosing Func is recomputed in every iteration of the next one's
  // loops, and a Func with updates may read its whole input each time.
  int share_of_nesting(int f) const { return is_pure(f) ? 1 : 2; }
  int nesting_of(const Level& level) const {
    const Placement& around = placements_[level.func];
    if (around.where != Where::At) return 0;
    return share_of_nesting(level.func) + nesting_of(around.compute);
  }

  bool is_around_all_sites(const Level& level, int f) const {
    return std::all_of(sites_[f].begin(), sites_[f].end(), [&](const Site& site) {
      const std::vector<Level> around = levels_around(site.first, site.second);
      return std::find(around.begin(), around.end(), level) != around.end();
    });
  }

  void choose_store_level(int f, const std::vector<Level>& around, int compute) {
    std::vector<Level> legal;
    bool open = true;  // up to the first loop that is not serial
    for (size_t i = compute; i < around.size() && open; ++i) {
      if (static_cast<int>(i) > compute && is_legal_level(around[i])) legal.push_back(around[i]);
      open = runs_in_order(around[i]);
    }
    if (open) legal.push_back({});
    if (legal.empty()) return;
    const int store = random_.below(static_cast<int>(legal.size()));
    placements_[f].stored_outside = true;
    if (random_.chance(50)) {
      const int hoist = random_.between(store, static_cast<int>(legal.size()) - 1);
      add(f, HoistStorage{{loop_level(legal[hoist])}});
      if (hoist > store && random_.chance(90)) {
        add(f, RingBuffer{random_.between(1, 4)});
        placements_[f].in_ring = true;
      }
    }
    add(f, StoreAt{{loop_level(legal[store])}});
  }

  // False if specializations order the loops in different ways.
  bool runs_in_order(const Level& level) const {
    const std::vector<Loops>& variants = loops_[level.func][level.stage];
    if (variants.size() > 1) return false;
    return std::all_of(variants[0].begin(), variants[0].end(), [&](const Loop& loop) {
      return loop.name != level.name || loop.type == ForType::Serial ||
             loop.type == ForType::Unrolled;
    });
  }

  // ---- storage and sizes ----

  // The contents of images are not part of a memoized Func's key.
  bool reads_image_parameters() const {
    const auto parameters = parameters_of({funcs_.begin(), funcs_.end()});
    return std::any_of(parameters.begin(), parameters.end(),
                       [](const auto& p) { return p->is_buffer && !p->is_literal; });
  }

  std::string random_dimension(int f) { return random_.pick(func(f).args); }

  void choose_storage(int f) {
    if (random_.chance(10)) add(f, StoreIn{MemoryType::Heap});
    const bool stored_outside = placements_[f].stored_outside;
    const bool memoized =
        !stored_outside && random_.chance(8) && !is_shared(f) && !reads_image_parameters();
    if (memoized) add(f, Memoize{});
    const bool in_ring = placements_[f].in_ring;  // and stored outside: not async
    if (!memoized && !in_ring && random_.chance(8) && !is_shared(f)) add(f, Async{});
    if (dimensions(f) == 0) return;
    if (!memoized && random_.chance(12)) {
      const int alignment = random_.pick(std::vector<int>{2, 4, 16, 5});
      add(f, AlignStorage{random_dimension(f), alignment});
    }
    if (!memoized && random_.chance(4)) add(f, BoundStorage{random_dimension(f), ample_storage});
    if (stored_outside && random_.chance(20)) {
      const int factor = random_.pick(std::vector<int>{64, 128, 256});
      add(f, FoldStorage{random_dimension(f), factor});
    }
    if (random_.chance(8)) {
      const int modulus = random_.between(2, 5);
      add(f, AlignBounds{random_dimension(f), modulus, random_.below(modulus)});
    }
    if (random_.chance(5)) add(f, AlignBounds{random_dimension(f), random_.between(2, 5), {}});
    if (dimensions(f) > 1 && random_.chance(15)) reorder_storage(f);
  }

  void reorder_storage(int f) {
    std::vector<std::string> order = func(f).args;
    for (size_t i = order.size() - 1; i > 0; --i) {
      std::swap(order[i], order[random_.below(static_cast<int>(i) + 1)]);
    }
    add(f, ReorderStorage{order});
  }

  // Promises about an output must hold for each of its regions.
  void choose_output_rules(int f) {
    const std::vector<oracle::Region> regions = regions_of(f);
    if (regions.size() > 1 || !random_.chance(25)) return;
    for (int d = 0; d < dimensions(f); ++d)
      add(f, promise(func(f).args[d], regions[0].mins[d], regions[0].extents[d]));
  }

  Directive promise(const std::string& dimension, int min, int extent) {
    if (random_.chance(60)) return BoundDimension{dimension, min, extent};
    if (random_.chance(50)) return BoundDimension{dimension, {}, extent};
    for (int modulus = 5; modulus > 1; --modulus) {
      const int remainder = ((min % modulus) + modulus) % modulus;
      if (extent % modulus == 0) return AlignBounds{dimension, modulus, remainder};
    }
    return BoundDimension{dimension, {}, extent};
  }

  const RandomProgram& program_;
  Choices& random_;
  const ScheduleStyle style_;
  LoopNames names_;
  ScheduleLog log_;
  Selector selector_;
  std::vector<FuncPtr> compiled_, funcs_;  // the outputs; all Funcs, producers first
  std::vector<std::vector<LoopVariants>> loops_;
  std::vector<std::set<Site>> sites_;
  std::vector<Placement> placements_;
  std::vector<Companion> companions_;
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
  return Scheduler(program, choices, style).run();
}

}  // namespace retrograde::fuzz
