#include "lower/loops/time_steps.h"

#include <algorithm>
#include <unordered_set>

#include "analysis/linear.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/markers.h"
#include "lower/statement_rewriter.h"
#include "lower/walk_in_bounds.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int64_t most_slots = 16;

using Names = std::unordered_set<std::string>;

Names loops_in(const Stmt& s) {
  Names names;
  walk(s, [&](const For& loop) { names.insert(loop.name); });
  return names;
}

bool reads_storage(const Expr& e) {
  return any_node(e, [](const Call& call) { return call.call_type != CallType::Operator; });
}

class StepFinder {
 public:
  StepFinder(const Realize& f, Substitution lets) : f_(f), lets_(std::move(lets)) {}

  std::optional<TimeSteps> find() {
    if (!find_stages() || uses_metadata()) return std::nullopt;
    // Outer lets come first, so each value is expanded once.
    walk(f_.body, [&](const LetStmt& let) { lets_[let.name] = expanded_value(let, lets_); });
    if (!find_loop() || !stores_are_own(Stmt(steps_.loop)) || !find_time() || !find_lag())
      return std::nullopt;
    for (size_t i = 0; i + 1 < steps_.stages->stmts.size(); ++i) {
      if (!add_earlier(steps_.stages->stmts[i])) return std::nullopt;
    }
    find_start();
    find_slots();
    return steps_;
  }

 private:
  const Realize& f_;
  Substitution lets_;
  TimeSteps steps_;
  BoundsMap iterations_;  // the range of the loop
  int64_t least_lag_ = 0, most_lag_ = 0;
  const ProducerConsumer* produce_ = nullptr;

  Expr expanded(const Expr& e) const {
    return ir::without_likely(substitute(ir::without_lets(e), lets_));
  }
  bool is_own(const Call& call) const {
    return call.call_type == CallType::Func && call.name == f_.name;
  }

  // ---- the parts of the statement ----

  // The block of stages. It is produced once, outside of any loop inside of the storage.
  bool find_stages() {
    int produced = 0;
    walk(f_.body, [&](const ProducerConsumer& n) { produced += n.name == f_.name && n.produces; });
    if (produced != 1 || !find_produce(f_.body)) return false;
    const Stmt* body = &produce_->body;
    while (const auto* let = body->as<LetStmt>()) body = &let->body;
    steps_.stages = body->as<Block>();
    return steps_.stages != nullptr;
  }

  bool find_produce(const Stmt& s) {
    const auto* n = s.as<ProducerConsumer>();
    if (n && n->name == f_.name && n->produces) produce_ = n;
    if (produce_ || s.as<For>() || s.as<Fork>() || s.as<Atomic>()) return produce_ != nullptr;
    for_each_child(
        s, [](const Expr&) {}, [&](const Stmt& part) { find_produce(part); });
    return produce_ != nullptr;
  }

  // Extern stages and the like access the storage by its layout.
  bool uses_metadata() const {
    Names names = {f_.name + ".buffer"};
    for (const std::string& name : ir::metadata_names(f_.name, f_.bounds.size()))
      names.insert(name);
    return any_node(
        f_.body,
        [&](const Expr& e) {
          const auto* v = e.as<Variable>();
          return v && names.count(v->name) > 0;
        },
        [&](const Stmt& s) {
          const auto* prefetch = s.as<Prefetch>();
          return prefetch && prefetch->name == f_.name;
        });
  }

  bool find_loop() {
    const Stmt* last = &steps_.stages->stmts.back();
    while (const auto* let = last->as<LetStmt>()) last = &let->body;
    steps_.loop = last->as<For>();
    return steps_.loop && steps_.loop->runs == ForType::Serial &&
           any_node(steps_.loop->body, [](const For&) { return true; });
  }

  // Whether a nest stores only to this Func and to Funcs that are stored inside of it, and has no other effect.
  bool stores_are_own(const Stmt& nest) const {
    Names own = {f_.name};
    walk(nest, [&](const Realize& n) { own.insert(n.name); });
    return !any_node(
        nest,
        [](const Expr& e) {
          const auto* call = e.as<Call>();
          return call && (!call->is_pure() || (call->is_extern() && !call->is_pure_extern()));
        },
        [&](const Stmt& s) {
          switch (s.kind()) {
            case Kind::Provide:
              return own.count(s.as<Provide>()->name) == 0;
            case Kind::For: {
              const ForType runs = s.as<For>()->runs;
              return runs != ForType::Serial && runs != ForType::Parallel &&
                     runs != ForType::Vectorized && runs != ForType::Unrolled;
            }
            case Kind::LetStmt:
            case Kind::IfThenElse:
            case Kind::Block:
            case Kind::Realize:
            case Kind::ProducerConsumer:
              return false;
            default:
              return true;
          }
        });
  }

  // ---- the steps ----

  bool find_time() {
    const For& loop = *steps_.loop;
    iterations_[loop.name] = {loop.min, simplify(loop.min + loop.extent - 1)};
    std::vector<const Provide*> stores;
    walk(loop.body, [&](const Provide& n) {
      if (n.name == f_.name) stores.push_back(&n);
    });
    if (stores.empty()) return false;
    for (size_t d = 0; d < f_.bounds.size(); ++d) {
      const Expr place = expanded(stores[0]->args[d]);
      if (!uses_variable(place, loop.name)) continue;
      if (steps_.time.defined()) return false;
      steps_.dimension = d;
      steps_.time = simplify(place);
    }
    if (!steps_.time.defined()) return false;
    const auto form = analysis::decompose(steps_.time, {loop.name});
    if (!form || form->coefficients.size() != 1 || std::abs(form->coefficients[0].second) != 1 ||
        uses_any_variable(form->rest, loops_in(loop.body)) || reads_storage(form->rest))
      return false;
    steps_.sign = static_cast<int>(form->coefficients[0].second);
    return std::ranges::all_of(stores, [&](const Provide* n) {
      return is_zero(simplify(expanded(n->args[steps_.dimension]) - steps_.time));
    });
  }

  // The range of an integer, if it is constant.
  std::optional<ConstantRange> range_of(const Expr& e, const Scope<Interval>& scope) const {
    const Interval range = bounds_of(simplify(e, iterations_), scope);
    if (!range.is_bounded()) return std::nullopt;
    const auto min = as_const_int(simplify(range.min)), max = as_const_int(simplify(range.max));
    return min && max ? std::optional(ConstantRange{*min, *max}) : std::nullopt;
  }

  // The hull of sign * (now - time read) over all reads of the Func in a statement; nullopt if one is unknown.
  std::optional<ConstantRange> age_of_reads(const Stmt& s, const Expr& now) const {
    std::optional<ConstantRange> all = ConstantRange{INT64_MAX, INT64_MIN};
    const auto on_expr = [&](const Expr& e, const Scope<Interval>& scope) {
      walk(ir::without_lets(e), [&](const Call& call) {
        if (!all || !is_own(call)) return;
        const Expr age = (now - expanded(call.args[steps_.dimension])) * steps_.sign;
        const auto range = range_of(age, scope);
        all = range ? std::optional(hull(*all, *range)) : std::nullopt;
      });
    };
    walk_in_bounds(s, on_expr, [](const Stmt&, const Scope<Interval>&) {});
    return all;
  }

  bool find_lag() {
    const auto lag = age_of_reads(Stmt(steps_.loop), steps_.time);
    if (!lag || lag->min < 0 || lag->max >= most_slots) return false;
    least_lag_ = lag->min;
    most_lag_ = std::max<int64_t>(lag->max, 0);
    return true;
  }

  // ---- the stages before ----

  bool add_earlier(const Stmt& nest) {
    if (const auto* empty = nest.as<Evaluate>()) return is_const(empty->value);
    if (!stores_are_own(nest)) return false;
    const Provide* store = nullptr;
    int stores = 0;
    walk(nest, [&](const Provide& n) {
      if (n.name == f_.name && ++stores == 1) store = &n;
    });
    if (stores != 1) return false;
    EarlierStage stage{nest};
    const Expr time = simplify(expanded(store->args[steps_.dimension]));
    if (!find_time_loop(time, stage) || !reads_only_at(time, nest)) return false;
    steps_.earlier.push_back(std::move(stage));
    return true;
  }

  static bool find_time_loop(const Expr& time, EarlierStage& stage) {
    const For* found = nullptr;
    int loops = 0;
    walk(stage.nest, [&](const For& loop) {
      if (!uses_variable(time, loop.name)) return;
      ++loops;
      found = &loop;
    });
    stage.offset = time;
    if (loops == 0) return !reads_storage(time);
    if (loops > 1 || (found->runs != ForType::Serial && found->runs != ForType::Parallel))
      return false;
    const auto form = analysis::decompose(time, {found->name});
    if (!form || form->coefficients.size() != 1 || std::abs(form->coefficients[0].second) != 1 ||
        reads_storage(form->rest))
      return false;
    stage.over_time = found;
    stage.sign = static_cast<int>(form->coefficients[0].second);
    stage.offset = form->rest;
    return true;
  }

  bool reads_only_at(const Expr& time, const Stmt& nest) const {
    bool same = true;
    walk(nest, [&](const Call& call) {
      if (is_own(call))
        same = same && is_zero(simplify(expanded(call.args[steps_.dimension]) - time));
    });
    return same;
  }

  // ---- what the slots hold ----

  // The expressions of a nest that decide which elements it stores; `with_values`: and what it stores.
  std::vector<Expr> parts_of(const Stmt& nest, const For* except, bool with_values) const {
    std::vector<Expr> parts;
    const auto add = [&](const Expr& e) {
      if (e.defined()) parts.push_back(expanded(e));
    };
    walk(
        nest,
        [&](const For& loop) {
          if (&loop == except) return;
          add(loop.min);
          add(loop.extent);
        },
        [&](const IfThenElse& n) { add(n.condition); },
        [&](const Provide& n) {
          for (size_t d = 0; d < n.args.size(); ++d) {
            if (n.name != f_.name || d != steps_.dimension) add(n.args[d]);
          }
          add(n.predicate);
          for (size_t i = 0; with_values && i < n.values.size(); ++i) add(n.values[i]);
        });
    return parts;
  }

  // Whether every step stores the same elements of its slice.
  bool steps_store_alike() const {
    return std::ranges::none_of(
        parts_of(Stmt(steps_.loop), steps_.loop, false),
        [&](const Expr& e) { return uses_variable(e, steps_.loop->name) || reads_storage(e); });
  }

  static bool are_alike(const std::vector<Expr>& parts, const std::string& time,
                        const BoundsMap& range) {
    return std::ranges::none_of(
        parts, [&](const Expr& e) { return uses_variable(simplify(e, range), time); });
  }

  void find_start() {
    if (least_lag_ < 1 || steps_.earlier.size() != 1 || !steps_store_alike()) return;
    const EarlierStage& stage = steps_.earlier[0];
    if (!stage.over_time) return;
    const std::string& time = stage.over_time->name;
    const std::vector<Expr> parts = parts_of(stage.nest, stage.over_time, true);
    if (are_alike(parts, time, {})) {
      steps_.start = SliceStart::Never;
      return;
    }
    const Interval& all = iterations_.at(steps_.loop->name);
    Expr first = (time_at(steps_, all.min) - stage.offset) * stage.sign;
    Expr last = (time_at(steps_, all.max) - stage.offset) * stage.sign;
    if (steps_.sign * stage.sign < 0) std::swap(first, last);
    if (are_alike(parts, time, {{time, {simplify(first), simplify(last)}}}))
      steps_.start = SliceStart::FirstSteps;
  }

  // How many slices before the end the statements after the steps read; nullopt if unknown.
  std::optional<int64_t> slices_read_later() const {
    const Stmt later = rewrite_statements(f_.body, [&](const Stmt& s, auto& all) {
      return s.get() == produce_ ? make_evaluate(0) : all.children(s);
    });
    if (any_node(later, [&](const Provide& n) { return n.name == f_.name; })) return std::nullopt;
    const auto age = age_of_reads(later, time_at(steps_, iterations_.at(steps_.loop->name).max));
    if (!age || age->min < 0 || age->max >= most_slots) return std::nullopt;
    return std::max<int64_t>(age->max + 1, 1);
  }

  void find_slots() {
    if (const auto later = slices_read_later()) steps_.slots = std::max(most_lag_ + 1, *later);
  }
};

}  // namespace

Expr expanded_value(const LetStmt& let, const Substitution& lets) {
  return substitute(ir::without_lets(let.value), lets);
}

Expr time_at(const TimeSteps& steps, const Expr& iteration) {
  return simplify(substitute(steps.time, steps.loop->name, iteration));
}

std::optional<TimeSteps> find_time_steps(const Realize& f, const Substitution& lets) {
  return StepFinder(f, lets).find();
}

}  // namespace retrograde::lower
