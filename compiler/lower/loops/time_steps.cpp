#include "lower/loops/time_steps.h"

#include <algorithm>
#include <unordered_set>

#include "analysis/linear.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/markers.h"
#include "lower/loops/earlier_stages.h"
#include "lower/loops/let_values.h"
#include "lower/statement_rewriter.h"
#include "lower/walk_in_bounds.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

using Names = std::unordered_set<std::string>;

Names loops_in(const Stmt& s) {
  Names names;
  walk(s, [&](const For& loop) { names.insert(loop.name); });
  return names;
}

class StepFinder {
 public:
  StepFinder(const Realize& f, const Substitution& lets) : f_(f), value_(lets) {}

  // Looks at the produced statement alone first, since most Funcs have no steps.
  std::optional<TimeSteps> find() {
    if (!find_stages() || !find_loop()) return std::nullopt;
    value_.add(produce_->body);
    if (!stores_only_to(f_.name, step_) || !find_time() || !find_lag()) return std::nullopt;
    if (!is_produced_once() || uses_metadata()) return std::nullopt;
    EarlierStages earlier(f_.name, steps_, value_);
    for (size_t i = 0; i + 1 < steps_.stages->stmts.size(); ++i) {
      if (!earlier.add(steps_.stages->stmts[i])) return std::nullopt;
    }
    if (least_lag_ >= 1)
      steps_.start = earlier.slice_start(step_, iterations_.at(steps_.loop->name));
    value_.add(f_.body);
    find_slots();
    return steps_;
  }

 private:
  const Realize& f_;
  LetValues value_;
  TimeSteps steps_;
  Stmt step_;             // the loop without consumers that have joined it (join_steps.h)
  BoundsMap iterations_;  // the range of the loop
  int64_t least_lag_ = 0, most_lag_ = 0;
  const ProducerConsumer* produce_ = nullptr;

  bool is_own(const Call& call) const {
    return call.call_type == CallType::Func && call.name == f_.name;
  }

  // ---- the parts of the statement ----

  bool is_produced_once() const {
    int produced = 0;
    walk(f_.body, [&](const ProducerConsumer& n) { produced += n.name == f_.name && n.produces; });
    return produced == 1;
  }

  // The block of stages, outside of any loop inside of the storage.
  bool find_stages() {
    if (!find_produce(f_.body)) return false;
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
    if (!steps_.loop || steps_.loop->runs != ForType::Serial) return false;
    step_ = without_consumers(*last);
    return any_node(step_.as<For>()->body, [](const For&) { return true; });
  }

  static Stmt without_consumers(const Stmt& loop) {
    Names own;
    walk(loop, [&](const Realize& n) { own.insert(n.name); });
    return rewrite_statements(loop, [&](const Stmt& s, auto& all) {
      const auto* n = s.as<ProducerConsumer>();
      return n && n->produces && own.count(n->name) == 0 ? make_evaluate(0) : all.children(s);
    });
  }

  // ---- the steps ----

  bool find_time() {
    const For& loop = *steps_.loop;
    const Expr first = value_(loop.min);
    iterations_[loop.name] = {simplify(first), simplify(first + value_(loop.extent) - 1)};
    std::vector<const Provide*> stores;
    walk(step_, [&](const Provide& n) {
      if (n.name == f_.name) stores.push_back(&n);
    });
    if (stores.empty()) return false;
    for (size_t d = 0; d < f_.bounds.size(); ++d) {
      const Expr place = value_(stores[0]->args[d]);
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
      return is_zero(simplify(value_(n->args[steps_.dimension]) - steps_.time));
    });
  }

  // The range of an integer, if it is constant.
  std::optional<ConstantRange> range_of(const Expr& e, const Scope<Interval>& scope) const {
    const Interval range = bounds_of(simplify(e, iterations_), scope);
    if (!range.is_bounded()) return std::nullopt;
    const auto min = as_const_int(simplify(range.min)), max = as_const_int(simplify(range.max));
    return min && max ? std::optional(ConstantRange{*min, *max}) : std::nullopt;
  }

  // The iteration of the steps in which alone a statement runs; undefined if there are others.
  Expr only_iteration(const Stmt& s) const {
    const auto* n = s.as<IfThenElse>();
    const auto* same = n && !n->when_false.defined() ? n->condition.as<EQ>() : nullptr;
    const auto* v = same ? same->a.as<Variable>() : nullptr;
    return v && v->name == steps_.loop->name ? same->b : Expr();
  }

  // The hull of sign * (now - time read) over all reads of the Func in a statement; nullopt if one is unknown.
  std::optional<ConstantRange> age_of_reads(const Stmt& s, const Expr& now) const {
    std::optional<ConstantRange> all = ConstantRange{INT64_MAX, INT64_MIN};
    const auto add = [&](const Stmt& part, const Expr& iteration) {
      const auto on_expr = [&](const Expr& e, const Scope<Interval>& scope) {
        walk(ir::without_lets(e), [&](const Call& call) {
          if (!all || !is_own(call)) return;
          Expr age = (now - value_(call.args[steps_.dimension])) * steps_.sign;
          if (iteration.defined()) age = substitute(age, steps_.loop->name, iteration);
          const auto range = range_of(age, scope);
          all = range ? std::optional(hull(*all, *range)) : std::nullopt;
        });
      };
      walk_in_bounds(part, on_expr, [](const Stmt&, const Scope<Interval>&) {});
    };
    const Stmt others = rewrite_statements(s, [&](const Stmt& part, auto& rest) {
      const Expr iteration = only_iteration(part);
      if (!iteration.defined()) return rest.children(part);
      add(part.as<IfThenElse>()->when_true, iteration);
      return make_evaluate(0);
    });
    add(others, {});
    return all;
  }

  bool find_lag() {
    const auto own = age_of_reads(step_, steps_.time);
    const auto all = age_of_reads(Stmt(steps_.loop), steps_.time);
    if (!own || !all || own->max < 1 || all->min < 0 || all->max >= most_step_slots) return false;
    least_lag_ = own->min;
    most_lag_ = std::max<int64_t>(all->max, 0);
    return true;
  }

  // ---- what is read later ----

  // How many slices before the end the statements after the steps read; nullopt if unknown.
  std::optional<int64_t> slices_read_later() const {
    const Stmt later = rewrite_statements(f_.body, [&](const Stmt& s, auto& all) {
      return s.get() == produce_ ? make_evaluate(0) : all.children(s);
    });
    if (any_node(later, [&](const Provide& n) { return n.name == f_.name; })) return std::nullopt;
    const auto age = age_of_reads(later, time_at(steps_, iterations_.at(steps_.loop->name).max));
    if (!age || age->min < 0 || age->max >= most_step_slots) return std::nullopt;
    return std::max<int64_t>(age->max + 1, 1);
  }

  void find_slots() {
    if (const auto later = slices_read_later()) steps_.slots = std::max(most_lag_ + 1, *later);
  }
};

}  // namespace

Expr time_at(const TimeSteps& steps, const Expr& iteration) {
  return simplify(substitute(steps.time, steps.loop->name, iteration));
}

std::optional<TimeSteps> find_time_steps(const Realize& f, const Substitution& lets) {
  return StepFinder(f, lets).find();
}

}  // namespace retrograde::lower
