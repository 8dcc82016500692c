// Draws random loop directives. They are legal by construction:
// - reduction loops keep their order and run serially, unless the iterations are independent or the update is
//   associative and atomic;
// - the tail of a split is legal for its loop (schedules/tails.h);
// - a loop inside a vectorized one has a constant extent.
#include "testing/random_loops.h"

#include <algorithm>
#include <map>

#include "graph/definitions/associative_update.h"
#include "graph/definitions/race_checks.h"
#include "graph/names.h"
#include "ir/build.h"
#include "testing/schedules/tails.h"

namespace retrograde::fuzz {

namespace {

constexpr int max_unrolled = 8;
constexpr int max_lanes = 64;

class LoopScheduler {
 public:
  LoopScheduler(Loops loops, const StageContext& context, const Selector& selector,
                ScheduleLog::Entry place, Choices& random, LoopNames& names, ScheduleLog& log)
      : loops_(std::move(loops)),
        context_(context),
        selector_(selector),
        place_(std::move(place)),
        random_(random),
        names_(names),
        log_(log) {}

  LoopVariants run() {
    if (loops_.empty()) return {loops_};
    if (random_.chance(5)) rename();
    const int splits = random_.below(4);
    for (int i = 0; i < splits; ++i) split(random_.below(static_cast<int>(loops_.size())));
    if (random_.chance(20)) fuse();
    if (has_reduction() && context_.is_associative && random_.chance(50)) make_atomic();
    if (has_reduction() && random_.chance(5)) add(graph::AllowRaces{});
    if (random_.chance(50)) reorder();
    if (context_.may_specialize && random_.chance(12)) specialize();
    run_kinds();
    if (random_.chance(8)) partition();
    if (has_failing_specialization_) add(graph::SpecializeFail{Expr("no specialization fits")});
    variants_.insert(variants_.begin(), loops_);
    return variants_;
  }

 private:
  void add(graph::Directive directive) {
    log_.entries.push_back({place_.func, place_.stage, place_.special, std::move(directive)});
  }

  int random_loop() { return random_.below(static_cast<int>(loops_.size())); }

  bool has_reduction() const {
    return std::any_of(loops_.begin(), loops_.end(), [](const Loop& l) { return l.is_reduction; });
  }

  void run_kinds() {
    if (random_.chance(60)) vectorize();
    if (random_.chance(12)) vectorize();
    if (random_.chance(30)) unroll();
    if (random_.chance(40)) parallelize();
    if (random_.chance(5)) make_serial();
  }

  // Adds specializations: copies of the current schedule, each with further directives.
  void specialize() {
    const int count = random_.between(1, 2);
    for (int i = 0; i < count; ++i) {
      const int condition = random_.below(3);
      if (i > 0 && condition == variant_condition_) continue;
      variant_condition_ = condition;
      has_failing_specialization_ |= condition == selector_.value && random_.chance(20);
      add(graph::Specialize{selector_.parameter == condition});
      ScheduleLog::Entry place = place_;
      place.special.push_back(static_cast<int>(variants_.size()));
      LoopScheduler inner(loops_, context_, selector_, place, random_, names_, log_);
      if (random_.chance(40)) inner.split(inner.random_loop());
      if (random_.chance(30)) inner.reorder();
      inner.run_kinds();
      variants_.push_back(inner.loops_);
    }
  }

  // ---- the shape of the loops ----

  void split(int at) {
    const Loop old = loops_[at];
    split(at, random_factor(), names_.fresh(stem(old) + "o"));
  }

  // Splits a loop; the outer loop may keep the name.
  void split(int at, int factor, const std::string& outer_name) {
    const Loop old = loops_[at];
    Loop outer = old, inner = old;
    outer.name = outer_name;
    inner.name = names_.fresh(stem(old) + "i");
    add(graph::SplitLoop{old.name, outer.name, inner.name, factor,
                         random_tail(old, factor, context_, random_)});
    outer.is_original = inner.is_original = false;
    outer.extent =
        old.extent == unknown_extent ? unknown_extent : (old.extent + factor - 1) / factor;
    inner.extent = factor;
    loops_[at] = outer;
    loops_.insert(loops_.begin() + at, inner);
  }

  int random_factor() { return random_.pick(std::vector<int>{2, 3, 4, 4, 5, 8, 8, 16}); }

  // The stem of new names, which marks reduction loops.
  static std::string stem(const Loop& loop) {
    return loop.is_reduction ? "rr" : loop.name.substr(0, 1);
  }

  void fuse() {
    if (loops_.size() < 2) return;
    const int at = random_.below(static_cast<int>(loops_.size()) - 1);
    const Loop inner = loops_[at], outer = loops_[at + 1];
    if (inner.is_reduction != outer.is_reduction) return;
    Loop fused = inner;
    fused.is_original = false;
    fused.dimension = -1;
    fused.is_independent = inner.is_independent && outer.is_independent;
    fused.name = names_.fresh(fused.is_reduction ? "rrt" : "t");
    const bool known = inner.extent != unknown_extent && outer.extent != unknown_extent;
    fused.extent = known ? inner.extent * outer.extent : unknown_extent;
    add(graph::FuseLoops{inner.name, outer.name, fused.name});
    loops_[at] = fused;
    loops_.erase(loops_.begin() + at + 1);
  }

  void rename() {
    Loop& loop = loops_[random_loop()];
    const std::string name = names_.fresh(stem(loop) + "n");
    add(graph::RenameLoop{loop.name, name});
    loop.name = name;
  }

  void reorder() {
    if (loops_.size() < 2) return;
    Loops shuffled = loops_;
    for (size_t i = shuffled.size() - 1; i > 0; --i) {
      std::swap(shuffled[i], shuffled[random_.below(static_cast<int>(i) + 1)]);
    }
    if (!context_.is_associative) restore_reduction_order(shuffled);
    loops_ = std::move(shuffled);
    graph::ReorderLoops order;
    for (const Loop& loop : loops_) order.loops.emplace_back(loop.name);
    add(std::move(order));
  }

  // Restores the order of the reduction loops, in the positions where reduction loops landed.
  void restore_reduction_order(Loops& shuffled) const {
    size_t next = 0;
    for (Loop& loop : shuffled) {
      if (!loop.is_reduction) continue;
      while (!loops_[next].is_reduction) ++next;
      loop = loops_[next++];
    }
  }

  // ---- how a loop runs ----

  bool may_run_at_once(const Loop& loop) const {
    return loop.is_independent && loop.type == ForType::Serial;
  }

  int lanes() const {
    int lanes = 1;
    for (const Loop& loop : loops_) lanes *= loop.type == ForType::Vectorized ? loop.extent : 1;
    return lanes;
  }

  void vectorize() {
    std::vector<int> candidates;
    for (size_t i = 0; i < loops_.size(); ++i) {
      const int extent = loops_[i].extent;
      const bool fits =
          extent == unknown_extent || (extent > 1 && extent <= 16 && extent * lanes() <= max_lanes);
      if (may_run_at_once(loops_[i]) && fits) candidates.push_back(static_cast<int>(i));
    }
    if (candidates.empty()) return;
    const int at = random_.pick(candidates);
    if (loops_[at].extent != unknown_extent) return set_type(at, ForType::Vectorized);
    split_and_set(at, ForType::Vectorized, lanes() > 4 ? 4 : random_factor());
  }

  void set_type(int at, ForType type) {
    loops_[at].type = type;
    add(graph::RunLoop{loops_[at].name, type});
  }

  // Splits and sets the type, as vectorize(x, 8) and similar directives do; the outer loop keeps the name.
  void split_and_set(int at, ForType type, int factor) {
    const Loop& old = loops_[at];
    split(at, factor, random_.chance(50) ? old.name : names_.fresh(stem(old) + "o"));
    set_type(type == ForType::Parallel ? at + 1 : at, type);
  }

  void unroll() {
    const int at = random_loop();
    if (loops_[at].type != ForType::Serial) return;
    if (loops_[at].extent == unknown_extent) {
      if (loops_[at].is_original) split_and_set(at, ForType::Unrolled, random_.between(2, 4));
    } else if (loops_[at].extent <= max_unrolled) {
      set_type(at, ForType::Unrolled);
    }
  }

  void parallelize() {
    const int at = random_.chance(70) ? static_cast<int>(loops_.size()) - 1 : random_loop();
    if (!may_run_at_once(loops_[at]) || is_in_vectorized(at)) return;
    if (random_.chance(20)) return split_and_set(at, ForType::Parallel, random_.between(2, 5));
    set_type(at, ForType::Parallel);
  }

  bool is_in_vectorized(int at) const {
    return std::any_of(loops_.begin() + at, loops_.end(),
                       [](const Loop& loop) { return loop.type == ForType::Vectorized; });
  }

  void make_serial() { set_type(random_loop(), ForType::Serial); }

  void make_atomic() {
    add(graph::MakeAtomic{});
    for (Loop& loop : loops_) loop.is_independent = true;
  }

  void partition() {
    const Loop& loop = loops_[random_loop()];
    add(graph::PartitionLoop{loop.name, random_.chance(50) ? Partition::Never : Partition::Always});
  }

  Loops loops_;
  const StageContext& context_;
  const Selector& selector_;
  const ScheduleLog::Entry place_;
  Choices& random_;
  LoopNames& names_;
  ScheduleLog& log_;
  std::vector<Loops> variants_;  // the loops of each specialization
  int variant_condition_ = -1;
  bool has_failing_specialization_ = false;
};

// The origin of a reduction loop: a variable that it derives from, and its extent if constant.
struct Origin {
  std::string variable;
  int extent = unknown_extent;
};
std::map<std::string, Origin> origins_of(const graph::Definition& definition) {
  std::map<std::string, Origin> origins;
  for (const graph::ReductionVariable& v : definition.rvars) {
    const auto extent = ir::as_const_int(v.extent);
    origins[v.var] = {v.var, static_cast<int>(extent.value_or(unknown_extent))};
  }
  for (const graph::Split& split : definition.schedule.splits) {
    const Origin old = origins[split.old_var];
    const auto factor = split.factor.defined() ? ir::as_const_int(split.factor) : std::nullopt;
    const int f = static_cast<int>(factor.value_or(1));
    origins[split.outer] = {old.variable, old.extent < 0 ? old.extent : (old.extent + f - 1) / f};
    if (factor) origins[split.inner] = {old.variable, f};
  }
  return origins;
}

}  // namespace

Loops loops_of(const graph::FuncContents& f, int stage) {
  const graph::Definition& definition = f.stage(stage);
  std::map<std::string, Origin> origins = origins_of(definition);
  Loops loops;
  for (const graph::Dim& dim : definition.schedule.dims) {
    Loop loop{graph::without_numbers(dim.var)};
    loop.is_reduction = dim.is_reduction;
    if (dim.is_reduction) {
      const Origin& origin = origins[dim.var];
      loop.extent = origin.extent;
      loop.is_independent = graph::can_prove_race_free(f, definition, origin.variable, {}, true);
    } else {
      loop.dimension = static_cast<int>(std::ranges::find(f.args, dim.var) - f.args.begin());
    }
    loops.push_back(loop);
  }
  return loops;
}

bool is_associative_update(const graph::FuncContents& f, int stage) {
  if (stage == 0) return false;
  const analysis::AssociativityProof proof = graph::prove_associative(f, f.stage(stage));
  if (!proof.op || !proof.op->commutative || proof.op->breaks_ties) return false;
  return std::all_of(proof.op->values.begin(), proof.op->values.end(), [](const Expr& value) {
    return !value.type().is_float() || value.as<ir::Min>() || value.as<ir::Max>();
  });
}

LoopVariants schedule_loops(Loops loops, const StageContext& context, const Selector& selector,
                            const ScheduleLog::Entry& place, Choices& random, LoopNames& names,
                            ScheduleLog& log) {
  return LoopScheduler(std::move(loops), context, selector, place, random, names, log).run();
}

}  // namespace retrograde::fuzz
