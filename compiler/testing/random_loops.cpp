// Kept legal by construction:
// - reduction loops keep their order and run one iteration after the other, unless the iterations
//   are independent or the update is associative and atomic;
// - outputs are rounded up or shifted inwards only where the extents of all runs allow it;
// - a loop inside a vectorized one has a constant extent.
#include "testing/random_loops.h"

#include <algorithm>
#include <functional>

namespace retrograde::fuzz {

namespace {

using Kind = Directive::Kind;

constexpr int max_unrolled = 8;
constexpr int max_lanes = 64;

bool is_pure_index(const Index& index, int d) {
  return index.variable == d && index.scale == 1 && index.divisor == 1 && index.offset == 0 &&
         !index.clamped && index.data.empty();
}

bool is_same(const Index& a, const Index& b) {
  return a.variable == b.variable && a.scale == b.scale && a.divisor == b.divisor &&
         a.offset == b.offset && a.clamped == b.clamped && a.data.empty() && b.data.empty();
}

// Whether iterations of reduction variable k touch different elements: some coordinate is it plus a
// constant, and what the update reads of the Func itself has the same coordinate there.
bool is_independent(const FuncSpec& func, int stage, int k) {
  const UpdateSpec& update = func.updates[stage - 1];
  for (int d = 0; d < func.dimensions; ++d) {
    const Index& left = update.left[d];
    const bool moves = left.variable == func.dimensions + k && left.scale == 1 &&
                       left.divisor == 1 && !left.clamped && left.data.empty();
    if (!moves) continue;
    bool same = true;
    for_each_term_of_stage(func, stage, [&](const Term& term) {
      if (term.action == Action::Self) same &= is_same(term.indices[d], left);
    });
    if (same) return true;
  }
  return false;
}

class LoopScheduler {
 public:
  LoopScheduler(Loops loops, const StageContext& context, int selector, Random& random,
                LoopNames& names, std::vector<Directive>& directives)
      : loops_(std::move(loops)),
        context_(context),
        selector_(selector),
        random_(random),
        names_(names),
        directives_(directives) {}

  StageLoops run() {
    if (loops_.empty()) return {{loops_}};
    if (random_.chance(5)) rename();
    const int splits = random_.below(4);
    for (int i = 0; i < splits; ++i) split(random_.below(static_cast<int>(loops_.size())));
    if (random_.chance(20)) fuse();
    if (has_reduction() && context_.is_associative && random_.chance(50)) make_atomic();
    if (has_reduction() && random_.chance(5)) add({Kind::AllowRaces, {}});
    if (random_.chance(50)) reorder();
    if (context_.may_specialize && random_.chance(12)) specialize();
    run_kinds();
    if (random_.chance(8)) partition();
    if (has_failing_specialization_) add({Kind::SpecializeFail, {}});
    variants_.insert(variants_.begin(), loops_);
    return {variants_};
  }

 private:
  void add(Directive directive) { directives_.push_back(std::move(directive)); }

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

  // A copy of the schedule so far with directives of its own.
  void specialize() {
    const int count = random_.between(1, 2);
    for (int i = 0; i < count; ++i) {
      Directive directive{Kind::Specialize, {}};
      directive.condition = random_.below(3);
      if (i > 0 && directive.condition == variant_condition_) continue;
      variant_condition_ = directive.condition;
      has_failing_specialization_ |= directive.condition == selector_ && random_.chance(20);
      LoopScheduler inner(loops_, context_, selector_, random_, names_, directive.nested);
      if (random_.chance(40)) inner.split(inner.random_loop());
      if (random_.chance(30)) inner.reorder();
      inner.run_kinds();
      variants_.push_back(inner.loops_);
      add(std::move(directive));
    }
  }

  // ---- the shape of the loops ----

  void split(int at) {
    const Loop old = loops_[at];
    if (old.name.empty()) return;
    const int factor = random_factor();
    Loop outer = old, inner = old;
    outer.name = names_.fresh(stem(old) + "o");
    inner.name = names_.fresh(stem(old) + "i");
    add({Kind::Split, {old.name, outer.name, inner.name}, factor, choose_tail(old, factor)});
    replace_by_split(at, outer, inner, factor);
  }

  int random_factor() { return random_.pick(std::vector<int>{2, 3, 4, 4, 5, 8, 8, 16}); }

  // Names of reduction loops say so.
  static std::string stem(const Loop& loop) {
    return loop.is_reduction ? "rr" : loop.name.substr(0, 1);
  }

  void replace_by_split(int at, Loop outer, Loop inner, int factor) {
    const int extent = loops_[at].extent;
    outer.is_original = inner.is_original = false;
    outer.extent = extent == unknown_extent ? unknown_extent : (extent + factor - 1) / factor;
    inner.extent = factor;
    loops_[at] = outer;
    loops_.insert(loops_.begin() + at, inner);
  }

  TailStrategy choose_tail(const Loop& loop, int factor) {
    std::vector<TailStrategy> legal = {TailStrategy::GuardWithIf, TailStrategy::GuardWithIf,
                                       TailStrategy::Predicate};
    if (loop.is_reduction) {
      legal.push_back(TailStrategy::Auto);
      return random_.pick(legal);
    }
    const bool inside_output = !context_.output_extents.empty();
    if (!loop.is_original && (inside_output || context_.is_update)) return random_.pick(legal);
    const bool fits = fits_output(loop, factor), divides = divides_output(loop, factor);
    if (fits && !context_.is_update) legal.push_back(TailStrategy::ShiftInwards);
    if (context_.is_update ? divides : fits) legal.push_back(TailStrategy::Auto);
    if (divides) {
      legal.insert(legal.end(), {TailStrategy::RoundUp, TailStrategy::RoundUp});
      if (loop.is_original) {
        legal.insert(legal.end(), {TailStrategy::PredicateLoads, TailStrategy::PredicateStores});
      }
    }
    return random_.pick(legal);
  }

  bool fits_output(const Loop& loop, int factor) const {
    return holds_for_output(loop, [&](int extent) { return extent >= factor; });
  }
  bool divides_output(const Loop& loop, int factor) const {
    return holds_for_output(loop, [&](int extent) { return extent % factor == 0; });
  }
  bool holds_for_output(const Loop& loop, const std::function<bool(int)>& test) const {
    if (context_.output_extents.empty()) return true;
    if (loop.dimension < 0) return false;
    const std::vector<int>& extents = context_.output_extents[loop.dimension];
    return std::all_of(extents.begin(), extents.end(), test);
  }

  void fuse() {
    if (loops_.size() < 2) return;
    const int at = random_.below(static_cast<int>(loops_.size()) - 1);
    const Loop inner = loops_[at], outer = loops_[at + 1];
    if (inner.name.empty() || outer.name.empty()) return;
    if (inner.is_reduction != outer.is_reduction) return;
    Loop fused = inner;
    fused.is_original = false;
    fused.dimension = -1;
    fused.is_independent = inner.is_independent && outer.is_independent;
    fused.name = names_.fresh(fused.is_reduction ? "rrt" : "t");
    const bool known = inner.extent != unknown_extent && outer.extent != unknown_extent;
    fused.extent = known ? inner.extent * outer.extent : unknown_extent;
    add({Kind::Fuse, {inner.name, outer.name, fused.name}});
    loops_[at] = fused;
    loops_.erase(loops_.begin() + at + 1);
  }

  void rename() {
    Loop& loop = loops_[random_loop()];
    if (loop.name.empty()) return;
    const std::string name = names_.fresh(stem(loop) + "n");
    add({Kind::Rename, {loop.name, name}});
    loop.name = name;
  }

  void reorder() {
    std::vector<int> slots;  // loops with a name
    for (size_t i = 0; i < loops_.size(); ++i) {
      if (!loops_[i].name.empty()) slots.push_back(static_cast<int>(i));
    }
    if (slots.size() < 2) return;
    Loops shuffled;
    for (const int slot : slots) shuffled.push_back(loops_[slot]);
    for (size_t i = shuffled.size() - 1; i > 0; --i) {
      std::swap(shuffled[i], shuffled[random_.below(static_cast<int>(i) + 1)]);
    }
    if (!context_.is_associative) restore_reduction_order(slots, shuffled);
    Directive directive{Kind::Reorder, {}};
    for (size_t i = 0; i < slots.size(); ++i) {
      loops_[slots[i]] = shuffled[i];
      directive.loops.push_back(shuffled[i].name);
    }
    add(std::move(directive));
  }

  // The reduction loops go back into their order, in the places where such loops landed.
  void restore_reduction_order(const std::vector<int>& slots, Loops& shuffled) const {
    size_t next = 0;
    for (Loop& loop : shuffled) {
      if (!loop.is_reduction) continue;
      while (!loops_[slots[next]].is_reduction) ++next;
      loop = loops_[slots[next++]];
    }
  }

  // ---- how a loop runs ----

  bool may_run_at_once(const Loop& loop) const {
    return loop.is_independent && loop.type == ForType::Serial && !loop.name.empty();
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
    add({kind_of(type), {loops_[at].name}});
  }

  static Kind kind_of(ForType type) {
    switch (type) {
      case ForType::Vectorized:
        return Kind::Vectorize;
      case ForType::Unrolled:
        return Kind::Unroll;
      case ForType::Parallel:
        return Kind::Parallel;
      default:
        return Kind::Serial;
    }
  }

  // By a split of its own, or by what vectorize(x, 8) and its like do.
  void split_and_set(int at, ForType type, int factor) {
    if (random_.chance(50)) {
      const Loop old = loops_[at];
      Loop inner = old;
      inner.name.clear();
      Loop outer = old;
      add({kind_of(type), {old.name}, factor, choose_tail(old, factor)});
      replace_by_split(at, outer, inner, factor);
      loops_[type == ForType::Parallel ? at + 1 : at].type = type;
      return;
    }
    const Loop old = loops_[at];
    Loop outer = old, inner = old;
    outer.name = names_.fresh(stem(old) + "o");
    inner.name = names_.fresh(stem(old) + "i");
    add({Kind::Split, {old.name, outer.name, inner.name}, factor, choose_tail(old, factor)});
    replace_by_split(at, outer, inner, factor);
    set_type(type == ForType::Parallel ? at + 1 : at, type);
  }

  void unroll() {
    const int at = random_loop();
    if (loops_[at].type != ForType::Serial || loops_[at].name.empty()) return;
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

  void make_serial() {
    Loop& loop = loops_[random_loop()];
    if (loop.name.empty()) return;
    loop.type = ForType::Serial;
    add({Kind::Serial, {loop.name}});
  }

  void make_atomic() {
    add({Kind::Atomic, {}});
    for (Loop& loop : loops_) loop.is_independent = true;
  }

  void partition() {
    const Loop& loop = loops_[random_loop()];
    if (loop.name.empty()) return;
    add({random_.chance(50) ? Kind::NeverPartition : Kind::AlwaysPartition, {loop.name}});
  }

  Loops loops_;
  const StageContext& context_;
  const int selector_;
  Random& random_;
  LoopNames& names_;
  std::vector<Directive>& directives_;
  std::vector<Loops> variants_;  // of the specializations
  int variant_condition_ = -1;
  bool has_failing_specialization_ = false;
};

bool reads_self(const Term& term) {
  bool found = false;
  for_each_term(term, [&](const Term& t) { found |= t.action == Action::Self; });
  return found;
}

bool is_exact(Action action, Type type) {
  if (action == Action::Max || action == Action::Min) return true;
  return type.is_bool() ? action == Action::Or : action == Action::Add && !type.is_float();
}

}  // namespace

Loops initial_loops(const FuncSpec& func, int stage) {
  static const char* const dimension_names[] = {"x", "y", "z"};
  Loops loops;
  if (stage > 0) {
    const auto& domain = func.updates[stage - 1].domain;
    for (size_t k = 0; k < domain.size(); ++k) {
      Loop loop{reduction_loop(static_cast<int>(k)), domain[k].extent};
      loop.is_reduction = true;
      loop.is_independent = is_independent(func, stage, static_cast<int>(k));
      loops.push_back(loop);
    }
  }
  for (int d = 0; d < func.dimensions; ++d) {
    if (stage > 0 && !is_pure_index(func.updates[stage - 1].left[d], d)) continue;
    Loop loop{dimension_names[d]};
    loop.dimension = d;
    loops.push_back(loop);
  }
  return loops;
}

bool is_associative_update(const FuncSpec& func, int stage) {
  if (stage == 0) return false;
  const UpdateSpec& update = func.updates[stage - 1];
  for (size_t v = 0; v < update.values.size(); ++v) {
    const Term& value = update.values[v];
    if (value.operands.size() != 2 || !is_exact(value.action, value.type)) return false;
    const Term& self = value.operands[0];
    if (self.action != Action::Self || self.element != static_cast<int>(v)) return false;
    for (size_t d = 0; d < update.left.size(); ++d) {
      const Index& left = update.left[d];
      if (left.data.empty() && !is_same(self.indices[d], left)) return false;
    }
    if (reads_self(value.operands[1])) return false;
  }
  for (const Term& predicate : update.predicate) {
    if (reads_self(predicate)) return false;
  }
  return true;
}

StageLoops schedule_loops(Loops loops, const StageContext& context, int selector, Random& random,
                          LoopNames& names, std::vector<Directive>& directives) {
  return LoopScheduler(std::move(loops), context, selector, random, names, directives).run();
}

}  // namespace retrograde::fuzz
