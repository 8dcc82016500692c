#include "autoschedule/access/dependences.h"

#include <algorithm>

#include "autoschedule/access/long_sums.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/race_checks.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::planning {

namespace {

using ir::ConstantRange;
using Terms = std::vector<IntegerSystem::Term>;

bool is_loop(const StageNode& stage, const Definition& definition, size_t iterator) {
  return iterator + 1 < stage.iterators.size() || !point_number(definition);
}

std::optional<int64_t> constant_extent(const Iterator& iterator) {
  return iterator.extent.defined() ? as_const_int(simplify(iterator.extent)) : std::nullopt;
}

ConstantRange range_of(const Iterator& iterator) {
  if (iterator.kind == Iterator::Kind::Pure) return {};
  const auto min = as_const_int(simplify(iterator.min)), extent = constant_extent(iterator);
  return {min.value_or(INT64_MIN), min && extent ? *min + *extent - 1 : INT64_MAX};
}

ConstantRange negative(const ConstantRange& range) {
  return {range.has_upper_bound() ? -range.max : INT64_MIN,
          range.has_lower_bound() ? -range.min : INT64_MAX};
}

// Conditions on two iterations of a stage, the first of which writes an element that the second one accesses.
class PairOfIterations {
 public:
  // Conditions that hold for all such pairs, with those of the predicate or without; or pairs for which they hold are
  // such pairs.
  enum class Kind : uint8_t { Necessary, WithoutPredicate, Sufficient };

  // Undefined: there are no sufficient conditions of this form.
  static std::optional<IntegerSystem> conditions(const StageNode& stage, const FuncContents& f,
                                                 const Access& access, Kind kind) {
    PairOfIterations pair(stage, f, kind);
    if (kind != Kind::WithoutPredicate) {
      for (const int iteration : {0, 1}) pair.add_guard(stage.guard, iteration);
    }
    if (kind == Kind::Sufficient) pair.add_guard(access.guard, 1);
    for (size_t d = 0; d < access.index.size(); ++d)
      pair.add_dimension(stage.write.index[d], access.index[d]);
    if (kind == Kind::Sufficient && !pair.is_exact_) return std::nullopt;
    pair.system_.combine_equations(pair.count());
    return std::move(pair.system_);
  }

 private:
  PairOfIterations(const StageNode& stage, const FuncContents& f, Kind kind)
      : stage_(stage), f_(f), kind_(kind) {
    for (const Iterator& i : stage.iterators) {
      const bool is_pure = i.kind == Iterator::Kind::Pure;
      const auto extent = is_pure ? std::optional<int64_t>(1) : constant_extent(i);
      system_.add_variable(extent ? ConstantRange{1 - *extent, *extent - 1} : ConstantRange());
    }
    for (const Iterator& i : stage.iterators) {
      const ConstantRange range = range_of(i);
      const int first = system_.add_variable(range);
      if (range.is_bounded())  // so is the second one's
        system_.add_condition({{first, 1}, {first - count(), 1}}, {-range.max, -range.min});
    }
  }

  const StageNode& stage_;
  const FuncContents& f_;
  const Kind kind_;
  bool is_exact_ = true;  // no condition is left out
  IntegerSystem system_;  // distances, iterators of the first iteration, further integers
  // Values that are not affine, by iteration; those that are the same for both count as the first one's.
  std::map<std::pair<Value, int>, int> values_;

  int count() const { return static_cast<int>(stage_.iterators.size()); }

  static void add(Terms& sum, int variable, int64_t coefficient) {
    const auto known = std::ranges::find(sum, variable, &IntegerSystem::Term::variable);
    if (known == sum.end())
      sum.push_back({variable, coefficient});
    else if ((known->coefficient += coefficient) == 0)
      sum.erase(known);
  }

  // Adds the numerator of a form in one of the iterations, without its constant.
  void add(Terms& sum, const IndexForm& form, int side, int64_t factor) {
    for (const Term& term : form.terms) {
      add(sum, count() + term.iterator, factor * term.coefficient);
      if (side == 1) add(sum, term.iterator, factor * term.coefficient);
    }
    for (const OpaqueTerm& term : form.opaque)
      add(sum, variable_of(term, side), factor * term.coefficient);
  }

  int variable_of(const OpaqueTerm& term, int side) {
    is_exact_ = is_exact_ && term.value.from_data;  // parameters may be related to sizes
    const bool is_same = is_same_for_both(term);
    const auto [place, is_new] = values_.try_emplace({term.value, is_same ? 0 : side}, 0);
    // The rules of directives know no ranges of values. All types hold 0 and 1.
    const bool is_example = kind_ == Kind::Sufficient;
    if (is_new)
      place->second = system_.add_variable(is_example ? ConstantRange{0, 1} : ConstantRange());
    return place->second;
  }
  bool is_same_for_both(const OpaqueTerm& term) const {
    const bool is_outside = std::ranges::all_of(term.value.iterators, [&](int16_t i) {
      return stage_.iterators[static_cast<size_t>(i)].kind == Iterator::Kind::Pure;
    });
    // Values that the update changes differ from iteration to iteration.
    bool reads_own = !term.expr.defined();
    if (term.expr.defined()) {
      walk(term.expr, [&](const Call& call) { reads_own = reads_own || is_call_of(call, &f_); });
    }
    return is_outside && !reads_own;
  }

  // floor(a / divisor) mod modulus is the same for both. A clamp makes different numbers equal, too.
  void add_dimension(const IndexForm& a, const IndexForm& b) {
    const bool are_alike = a.divisor == b.divisor && a.modulus == b.modulus;
    is_exact_ = is_exact_ && are_alike;
    if (!are_alike || (kind_ != Kind::Sufficient && (a.clamped || b.clamped))) return;
    if (a.modulus == 0) {
      const int64_t rest = a.divisor - 1;
      Terms sum;
      add(sum, a, 0, 1);
      add(sum, b, 1, -1);
      system_.add_condition(sum, {a.low - b.high - rest, a.high - b.low + rest});
      if (a.divisor == 1) return;
    }
    const int result = system_.add_variable();
    for (const int side : {0, 1}) {
      const IndexForm& form = side == 0 ? a : b;
      Terms sum;
      add(sum, form, side, 1);
      add(sum, result, -form.divisor);
      if (form.modulus != 0) add(sum, system_.add_variable(), -form.divisor * form.modulus);
      system_.add_condition(sum, {form.low - (form.divisor - 1), form.high});
    }
  }

  void add_guard(const Guard& guard, int side) {
    is_exact_ = is_exact_ && guard.others.empty();
    for (const Congruence& c : guard.congruences) {
      Terms sum;
      add(sum, system_.add_variable(), -c.modulus);
      // The form is that of the remainder.
      add_condition(c.form, c.form.modulus, side, sum, {-c.remainder, -c.remainder});
    }
    for (const IndexForm& form : guard.nonnegative)
      add_condition(form, 0, side, {}, {INT64_MIN, 0});
  }
  void add_condition(const IndexForm& form, int64_t modulus, int side, Terms sum,
                     ConstantRange constant) {
    const bool is_simple = !form.clamped && form.divisor == 1 && form.modulus == modulus;
    is_exact_ = is_exact_ && is_simple;
    if (!is_simple) return;
    add(sum, form, side, 1);
    if (constant.has_lower_bound()) constant.min += form.low;
    constant.max += form.high;
    system_.add_condition(sum, constant);
  }
};

// Whether a loop of the same iterator with a larger step is inside: the loop runs over remainders. 0: it does not.
int64_t period_of(const std::vector<LoopStep>& loops, size_t depth) {
  int64_t period = 0;
  for (size_t d = depth + 1; d < loops.size(); ++d) {
    if (loops[d].iterator == loops[depth].iterator && loops[d].step > loops[depth].step)
      period = std::max(period, loops[d].step);
  }
  return period;
}

// Tries the smallest numbers.
bool has_solution(IntegerSystem system) {
  for (int variable = 0; variable < system.variables(); ++variable) {
    if (!system.narrow()) return false;
    const ConstantRange range = system.range(variable);
    const int64_t smallest = range.contains(0) ? 0 : range.min > 0 ? range.min : range.max;
    system.restrict(variable, ConstantRange::point(smallest));
  }
  return system.narrow();
}

// The iterators all of whose loops are outside of this one.
IteratorSet iterators_around(const std::vector<LoopStep>& loops, size_t depth) {
  IteratorSet result = 0, inside = 0;
  for (size_t d = 0; d < loops.size(); ++d) {
    IteratorSet& side = d < depth ? result : inside;
    side |= set_of(loops[d].iterator);
  }
  return result & ~inside;
}

}  // namespace

// The outermost loop in which both iterations differ decides their order.
bool keeps(const Dependence& dependence, const std::vector<LoopStep>& loops) {
  for (size_t d = 0; d < loops.size(); ++d) {
    const ConstantRange& distance = dependence.distances[static_cast<size_t>(loops[d].iterator)];
    const int64_t period = period_of(loops, d);
    if (period != 0 && distance.is_point() && distance.min % period == 0) continue;
    if (distance.min < 0 || period != 0) return false;
    if (distance.min >= loops[d].step) return true;
  }
  return true;
}

// ---- from forms ----

StageDependences::StageDependences(const AccessGraph& graph, StageId id, bool with_predicate) {
  const StageNode& stage = graph.stage(id);
  const FuncContents& f = *graph.func(id.func).func;
  iterators_ = stage.iterators.size();
  for (size_t i = iterators_; i-- > 0;) {
    const bool is_reduction = stage.iterators[i].kind == Iterator::Kind::Reduction;
    if (is_reduction && is_loop(stage, f.stage(id.stage), i))
      levels_.push_back(static_cast<int>(i));
  }
  const bool never_runs = std::ranges::any_of(
      stage.iterators, [](const Iterator& i) { return constant_extent(i).value_or(1) <= 0; });
  if (never_runs) levels_.clear();
  if (levels_.empty()) return;
  // A store may leave an element as it was.
  const bool may_keep = std::ranges::any_of(stage.reads, [&](const Access& read) {
    return read.same_place(stage.write) && !read.guard.is_empty();
  });
  using Kind = PairOfIterations::Kind;
  const auto add = [&](const Access& access) {
    const Kind kind = with_predicate ? Kind::Necessary : Kind::WithoutPredicate;
    pairs_.push_back(*PairOfIterations::conditions(stage, f, access, kind));
    find_dependences(pairs_.back());
    if (!access.writes && may_keep) return;
    const auto certain = PairOfIterations::conditions(stage, f, access, Kind::Sufficient);
    if (certain) certain_pairs_.push_back(*certain);
  };
  add(stage.write);
  for (const Access& read : stage.reads) {
    if (read.of == id.func && !read.same_place(stage.write)) add(read);
  }
}

IntegerSystem StageDependences::differing(const IntegerSystem& pair, int iterator,
                                          IteratorSet around, bool upwards) const {
  IntegerSystem result = pair;
  for (const int i : levels_) {
    // The last bit of a set is no single iterator.
    if (i != iterator && i < 31 && (around & set_of(i)))
      result.restrict(i, ConstantRange::point(0));
  }
  result.restrict(iterator, upwards ? ConstantRange{1, INT64_MAX} : ConstantRange{INT64_MIN, -1});
  return result;
}

void StageDependences::find_dependences(const IntegerSystem& pair) {
  IteratorSet outer = 0;
  for (const int level : levels_) {
    for (const bool writes_first : {true, false}) {
      IntegerSystem system = differing(pair, level, outer, writes_first);
      if (!system.narrow()) continue;
      Dependence found;
      for (size_t i = 0; i < iterators_; ++i) {
        const ConstantRange range = system.range(static_cast<int>(i));
        found.distances.push_back(writes_first ? range : negative(range));
      }
      if (std::ranges::find(dependences_, found) == dependences_.end())
        dependences_.push_back(std::move(found));
    }
    outer |= set_of(level);
  }
}

bool StageDependences::are_independent(int iterator, IteratorSet around) const {
  if (std::ranges::find(levels_, iterator) == levels_.end()) return true;
  return std::ranges::none_of(pairs_, [&](const IntegerSystem& pair) {
    return differing(pair, iterator, around, true).narrow() ||
           differing(pair, iterator, around, false).narrow();
  });
}

bool StageDependences::are_dependent(int iterator, IteratorSet around) const {
  return std::ranges::any_of(certain_pairs_, [&](const IntegerSystem& pair) {
    return has_solution(differing(pair, iterator, around, true)) ||
           has_solution(differing(pair, iterator, around, false));
  });
}

bool StageDependences::writes_once(IteratorSet iterators) const {
  if (pairs_.empty()) return true;
  return std::ranges::all_of(levels_, [&](int level) {
    return (iterators & set_of(level)) == 0 ||
           !differing(pairs_[0], level, ~iterators, true).narrow();
  });
}

// ---- with the rules of directives ----

Dependences::Known& Dependences::known(StageId stage) {
  auto found = known_.find(stage);
  if (found == known_.end())
    found = known_.emplace(stage, Known{StageDependences(graph_, stage), {}, {}, {}}).first;
  return found->second;
}

const StageDependences& Dependences::of(StageId stage) { return known(stage).forms; }

bool Dependences::may_run_at_once(StageId stage, int iterator, IteratorSet around) {
  const auto [answer, is_new] = known(stage).at_once.try_emplace({iterator, around}, false);
  if (is_new) answer->second = can_prove_at_once(stage, iterator, around);
  return answer->second;
}

bool Dependences::can_prove_at_once(StageId stage, int iterator, IteratorSet around) {
  const StageDependences& forms = of(stage);
  if (forms.are_dependent(iterator, around)) return false;
  const StageNode& node = graph_.stage(stage);
  if (node.iterators[static_cast<size_t>(iterator)].kind == Iterator::Kind::Pure) return true;
  // The rules may understand less of a predicate.
  const bool is_proven = forms.are_independent(iterator, around) &&
                         (node.guard.is_empty() ||
                          StageDependences(graph_, stage, false).are_independent(iterator, around));
  if (is_proven) return true;
  const FuncContents& f = *graph_.func(stage.func).func;
  const Definition& update = f.stage(stage.stage);
  const std::string& name = node.iterators[static_cast<size_t>(iterator)].name;
  std::unordered_set<std::string> names;
  for (size_t i = 0; i < node.iterators.size(); ++i)
    if (around & set_of(static_cast<int>(i))) names.insert(node.iterators[i].name);
  return can_prove_race_free(f, update, name, names, /*in_kernel=*/false, ProofEffort::Quick);
}

bool Dependences::commutes(StageId stage) {
  Known& known = this->known(stage);
  if (!known.commutes) {
    const FuncContents& f = *graph_.func(stage.func).func;
    const Definition& update = f.stage(stage.stage);
    known.commutes =
        stage.stage == 0 || stores_one_value(f, update) || can_prove_commutative(f, update);
  }
  return *known.commutes;
}

bool Dependences::may_be_atomic(StageId stage, Atomics atomics) {
  const StageNode& node = graph_.stage(stage);
  const FuncContents& f = *graph_.func(stage.func).func;
  if (atomics == Atomics::None || stage.stage == 0 || f.types.size() != 1 || adds_in_place(node))
    return false;
  const Type type = f.types[0];
  const bool has_operation = type.is_scalar() && (type.bits() == 32 || type.bits() == 64);
  if (!has_operation || (type.is_float() && atomics != Atomics::OfAll)) return false;
  const bool reads_others = std::ranges::any_of(node.reads, [&](const Access& read) {
    return read.of == stage.func && read.index != node.write.index;
  });
  const bool meets = std::ranges::any_of(
      reduction_of(node), [&](int iterator) { return !may_run_at_once(stage, iterator); });
  return meets && !reads_others && can_prove_commutative(f, f.stage(stage.stage));
}

bool Dependences::keeps_order(StageId stage, const std::vector<LoopStep>& loops) {
  for (size_t d = 0; d < loops.size(); ++d) {
    const LoopStep& loop = loops[d];
    if (loop.is_concurrent && !may_run_at_once(stage, loop.iterator, iterators_around(loops, d)))
      return false;
  }
  const StageDependences& forms = of(stage);
  return std::ranges::all_of(forms.all(), [&](const Dependence& d) { return keeps(d, loops); }) ||
         keeps_order_of_variables(stage, loops);
}

// Proves it for loops that are the reduction variables themselves.
bool Dependences::keeps_order_of_variables(StageId stage, const std::vector<LoopStep>& loops) {
  const FuncContents& f = *graph_.func(stage.func).func;
  const Definition& update = f.stage(stage.stage);
  if (point_number(update)) return false;
  std::vector<std::string> order;
  for (const LoopStep& loop : loops) {
    const Iterator& iterator = graph_.stage(stage).iterators[static_cast<size_t>(loop.iterator)];
    if (iterator.kind == Iterator::Kind::Reduction) order.insert(order.begin(), iterator.name);
  }
  if (order.size() != update.rvars.size()) return false;
  const auto [answer, is_new] = known(stage).orders.try_emplace(order, false);
  if (is_new)
    answer->second =
        can_prove_same_order(f, update, ir::mapped(update.rvars, &ReductionVariable::var), order);
  return answer->second;
}

}  // namespace retrograde::planning
