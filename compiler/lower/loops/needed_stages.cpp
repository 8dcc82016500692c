#include "lower/loops/needed_stages.h"

#include <algorithm>
#include <set>
#include <unordered_set>
#include <utility>
#include <vector>

#include "ir/build.h"
#include "lower/loops/needed_where.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// Choices in one expression, and their nesting depth; conditions of choices beyond either limit count as true.
constexpr int most_choices = 64, deepest_choice = 4;

bool is_choice(const Expr& e) { return e.as<Select>() || as_op(e, Op::if_then_else); }

bool reads_funcs(const Expr& e) {
  return any_node(e, [](const Call& call) { return call.call_type == CallType::Func; });
}

// Whether the operator accepts arbitrary operands if its result is unused. Promises do not, as they may be checked.
bool is_plain_operator(const Call& call) {
  if (call.call_type != CallType::Operator) return false;
  const OpClass cls = op_info(call.op).cls;
  const bool promises = call.is_op(Op::promise_clamped, Op::unsafe_promise_clamped);
  return cls == OpClass::Pure || (cls == OpClass::Marker && !promises);
}

// Whether the statement computes a single point and calls no C function, which may take long.
bool is_one_point(const Stmt& s) {
  return !any_node(
      s,
      [](const Expr& e) {
        const auto* call = e.as<Call>();
        return call && call->call_type == CallType::Extern;
      },
      [](const Stmt& part) {
        const auto* loop = part.as<For>();
        return loop && !is_one(simplify(loop->extent));
      });
}

class NeedFinder {
 public:
  explicit NeedFinder(FunctionRef<bool(const std::string&)> may_skip) : may_skip_(may_skip) {}

  StageGuards find(const Stmt& s) {
    visit(s);
    return std::move(guards_);
  }

 private:
  // A condition in force, inside of the first `binders` binders.
  struct Held {
    Expr condition;
    size_t binders;
    AtLoops at_loops;
    int guards = 0;  // number of guards around it
  };
  // A Func whose storage contains the current statement.
  struct Stage {
    size_t binders, held;  // outside of its storage
    int guards;
    Expr needed = const_false();
    bool is_read = false;
    std::vector<Stmt> producers = {};
    std::set<std::string> mentioned_by =
        {};                               // Funcs further out whose condition mentions this one's
    std::set<std::string> complete = {};  // Funcs that are complete when its storage begins
  };

  static std::string need_of(const std::string& func) { return func + ".needed"; }

  // ---- statements ----

  void visit(const Stmt& s) {
    if (!s.defined()) return;
    match(
        s, [&](const LetStmt& n) { visit_let(n); }, [&](const For& n) { visit_loop(n); },
        [&](const IfThenElse& n) { visit_branch(n); }, [&](const Realize& n) { visit_storage(n); },
        [&](const ProducerConsumer& n) { visit_producer(s, n); },
        [&](const Provide& n) { visit_store(n); },
        [&](const StmtNode&) {
          for_each_child(
              s, [&](const Expr& e) { visit_values({e}); },
              [&](const Stmt& child) { visit(child); });
        });
  }

  void visit_let(const LetStmt& n) {
    visit_values({n.value});
    if (uses_any_variable(n.value, varying_)) varying_.insert(n.name);
    if (uses_any_variable(n.value, lanes_)) lanes_.insert(n.name);
    binders_.push_back({n.name, n.value, {}, {}});
    visit(n.body);
    binders_.pop_back();
  }

  void visit_loop(const For& n) {
    visit_values({n.min, n.extent});
    varying_.insert(n.name);
    if (n.runs == ForType::Vectorized) lanes_.insert(n.name);
    kernels_ += is_gpu(n.runs);
    binders_.push_back({n.name, {}, n.min, n.extent});
    visit(n.body);
    binders_.pop_back();
    kernels_ -= is_gpu(n.runs);
  }

  void visit_branch(const IfThenElse& n) {
    visit_values({n.condition});
    const auto where = [&](bool holds) {
      return without_calls(without_any_reads(usable_where(n.condition, holds)));
    };
    under(where(true), AtLoops::Forget, [&] { visit(n.when_true); });
    under(where(false), AtLoops::Forget, [&] { visit(n.when_false); });
  }

  void visit_store(const Provide& n) {
    guards_around_ += n.predicate.defined();
    visit_values(n.args);
    visit_values({n.predicate});
    visit_values(n.values);
    guards_around_ -= n.predicate.defined();
  }

  void visit_storage(const Realize& n) {
    for (const Range& side : n.bounds) visit_values({side.min, side.extent});
    const bool is_candidate = may_skip_(n.name) && kernels_ == 0 && waiting_ == 0 &&
                              !stages_.contains(n.name) && !forbidden_.contains(n.name);
    forbidden_.insert(n.name);  // unique names only: a name that occurs again is not a candidate
    if (!is_candidate) {
      const bool waits = !may_skip_(n.name);
      waiting_ += waits;
      visit(n.body);
      waiting_ -= waits;
      return;
    }
    stages_.emplace(n.name, Stage{.binders = binders_.size(),
                                  .held = held_.size(),
                                  .guards = guards_around_,
                                  .complete = complete_});
    visit(n.body);
    close(n.name);
  }

  void visit_producer(const Stmt& s, const ProducerConsumer& n) {
    const auto stage = stages_.find(n.name);
    if (n.produces && runs_on_device(n.body)) on_device_.insert(n.name);
    if (!n.produces) return visit_consumer(n);
    if (stage == stages_.end()) return visit(n.body);
    stage->second.producers.push_back(s);
    producing_.push_back(n.name);
    under(variable(need_of(n.name), Bool()), AtLoops::Forget, [&] { visit(n.body); });
    producing_.pop_back();
  }

  // A complete Func in host memory may be read by the conditions of the Funcs that follow.
  void visit_consumer(const ProducerConsumer& n) {
    const bool is_there =
        may_skip_(n.name) && !on_device_.contains(n.name) && complete_.insert(n.name).second;
    visit(n.body);
    if (is_there) complete_.erase(n.name);
  }

  static bool runs_on_device(const Stmt& s) {
    return any_node(s, [](const For& loop) { return is_gpu(loop.runs); });
  }

  static Expr without_any_reads(const Expr& condition) {
    return without_reads(condition, [](const Call&) { return false; });
  }

  template <class Body>
  void under(const Expr& condition, AtLoops at_loops, Body&& body) {
    const bool is_said = !is_const_true(condition);
    if (is_said) held_.push_back({condition, binders_.size(), at_loops, guards_around_});
    guards_around_++;
    body();
    guards_around_--;
    if (is_said) held_.pop_back();
  }

  // ---- needs ----

  Expr seen_from(const Held& held, size_t outside) const {
    Expr condition = held.condition;
    for (size_t i = held.binders; i-- > outside && !is_const_true(condition);)
      condition = from_outside(condition, binders_[i], held.at_loops);
    return condition;
  }

  // Records a read. Reads by the Func's own updates do not make it needed.
  void read(const std::string& func) {
    const auto found = stages_.find(func);
    if (found == stages_.end()) return;
    for (const std::string& own : producing_) {
      if (own == func) return;
    }
    Stage& stage = found->second;
    stage.is_read = true;
    if (is_const_true(stage.needed)) return;
    Expr where = const_true();
    for (size_t i = stage.held; i < held_.size(); i++) {
      // Under another guard, a read in the condition may be out of bounds where that guard does not hold.
      const bool is_outermost = held_[i].guards == stage.guards;
      where =
          both(where, without_reads(seen_from(held_[i], stage.binders), [&](const Call& call) {
                 return is_outermost && kernels_ == 0 &&
                        (call.call_type == CallType::Image || stage.complete.contains(call.name));
               }));
    }
    // A select evaluates C functions in its condition always, so the call can be moved; elsewhere it stays.
    if (outside_ > stage.held) where = without_calls(where);
    add_need(func, stage, where);
  }

  void add_need(const std::string& func, Stage& stage, const Expr& where) {
    stage.needed = either(stage.needed, where);
    note_mentions(where, func);
  }

  void note_mentions(const Expr& where, const std::string& func) {
    walk(where, [&](const Variable& v) {
      const size_t mark = v.name.rfind(".needed");
      if (mark == std::string::npos) return;
      const auto other = stages_.find(v.name.substr(0, mark));
      if (other != stages_.end()) other->second.mentioned_by.insert(func);
    });
  }

  // The storage of the Func ends here, so all of its reads are known.
  void close(const std::string& func) {
    const Stage stage = std::move(stages_.at(func));
    stages_.erase(func);
    Expr need = need_outside(stage);
    // A single point is decided now, because its condition determines where the Funcs that it reads are needed.
    if (std::ranges::any_of(stage.producers, is_one_point)) {
      need = known_part(need);
      if (uses_any_variable(need, varying_)) need = const_true();
    }
    for (const std::string& reader : stage.mentioned_by) {
      const auto outer = stages_.find(reader);
      if (outer == stages_.end()) continue;
      const Expr whole = seen_from({without_any_reads(need), binders_.size(), AtLoops::Forget},
                                   outer->second.binders);
      outer->second.needed = simplify(substitute(outer->second.needed, need_of(func), whole));
      note_mentions(whole, reader);
    }
    open_needs_[func] = need;
    settle(func);
  }

  // A condition that mentions Funcs whose storage is still open is settled when that storage ends. Only then is it
  // known where those Funcs are computed, and so where they read this one.
  void settle(const std::string& func) {
    const Expr need = open_needs_.at(func);
    if (uses_any_variable(need, unsettled())) return;
    open_needs_.erase(func);
    if (!is_const_true(need)) guards_[func] = need;
    std::vector<std::string> waiting;
    for (auto& [name, other] : open_needs_) {
      if (!uses_variable(other, need_of(func))) continue;
      other = simplify(substitute(other, need_of(func), need));
      waiting.push_back(name);
    }
    for (const std::string& name : waiting) {
      if (open_needs_.contains(name)) settle(name);
    }
  }

  std::unordered_set<std::string> unsettled() const {
    std::unordered_set<std::string> names;
    for (const auto& [name, stage] : stages_) names.insert(need_of(name));
    for (const auto& [name, need] : open_needs_) names.insert(need_of(name));
    return names;
  }
  // Parts that are not settled yet count as true.
  Expr known_part(const Expr& need) const { return simplify(without_parts_of(need, unsettled())); }

  // The condition outside of the Func's storage; true if a condition may be wrong there.
  Expr need_outside(const Stage& stage) const {
    if (!stage.is_read || is_const_true(stage.needed)) return const_true();
    if (std::ranges::any_of(stage.producers, computes_others)) return const_true();
    return simplify(without_parts_of(stage.needed, lanes_));
  }

  // Whether the producer contains kernels, or computes Funcs stored elsewhere.
  static bool computes_others(const Stmt& producer) {
    std::set<std::string> own{producer.as<ProducerConsumer>()->name};
    bool result = false;
    walk(
        producer, [](const Expr&) { return false; },
        [&](const Stmt& part) {
          if (const auto* storage = part.as<Realize>()) own.insert(storage->name);
          if (const auto* store = part.as<Provide>()) result |= !own.contains(store->name);
          if (const auto* loop = part.as<For>()) result |= is_gpu(loop->runs);
          return !result;
        });
    return result;
  }

  // ---- expressions ----

  void visit_values(const std::vector<Expr>& values) {
    for (const Expr& e : values) {
      if (!e.defined()) continue;
      seen_.clear();
      choices_ = arms_ = 0;
      outside_ = held_.size();
      let_names_.clear();
      if (any_node(e, [](const Expr& node) { return is_choice(node); })) {
        visit(e, 0, 0);
      } else {
        walk(e, [&](const Call& call) {
          if (call.call_type == CallType::Func) read(call.name);
        });
      }
    }
  }

  // `choice`: the number of the innermost choice around; 0: none.
  void visit(const Expr& e, int choice, int depth) {
    if (seen_.contains({e.get(), 0}) || !seen_.insert({e.get(), choice}).second) return;
    if (const auto* select = e.as<Select>())
      return visit_choice(select->condition, select->when_true, select->when_false, choice, depth);
    const auto* call = e.as<Call>();
    if (call && call->is_op(Op::if_then_else))
      return visit_choice(call->args[0], call->args[1], call->args[2], choice, depth);
    const auto* let = e.as<ir::Let>();
    if (let) let_names_.insert(let->name);
    const bool is_plain = !let && (!call || is_plain_operator(*call));
    if (call && call->call_type == CallType::Func) read(call->name);
    if (let) {
      outside_of_choices([&] { visit(let->value, 0, 0); });
      return visit(let->body, choice, depth);
    }
    for_each_child(e, [&](const Expr& child) {
      if (is_plain) return visit(child, choice, depth);
      outside_of_choices([&] { visit(child, 0, 0); });
    });
  }

  // Visits an operand that is evaluated whatever is chosen, and whose value must be valid.
  template <class Body>
  void outside_of_choices(Body&& body) {
    std::vector<Held> inside(held_.begin() + static_cast<std::ptrdiff_t>(outside_), held_.end());
    held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(outside_), held_.end());
    body();
    held_.insert(held_.end(), inside.begin(), inside.end());
  }

  void visit_choice(const Expr& condition, const Expr& a, const Expr& b, int choice, int depth) {
    visit(condition, choice, depth);
    const bool is_too_much = ++choices_ > most_choices || depth >= deepest_choice;
    const AtLoops at_loops =
        !is_too_much && reads_funcs(a) && reads_funcs(b) ? AtLoops::Range : AtLoops::Forget;
    for (const bool holds : {true, false}) {
      const Expr where =
          is_too_much ? const_true() : without_parts_of(usable_where(condition, holds), let_names_);
      const int inner = is_const_true(where) ? choice : ++arms_;
      under(where, at_loops, [&] { visit(holds ? a : b, inner, depth + 1); });
    }
  }

  FunctionRef<bool(const std::string&)> may_skip_;
  StageGuards guards_;
  int guards_around_ = 0;                // choices, branches, predicates, producers
  std::map<std::string, Stage> stages_;  // Funcs whose storage is open
  std::map<std::string, Expr>
      open_needs_;  // of Funcs whose storage has ended; mention unsettled Funcs
  std::vector<Binder> binders_;
  std::vector<Held> held_;
  std::vector<std::string> producing_;
  std::unordered_set<std::string> varying_;  // loop variables, and lets that depend on them
  std::unordered_set<std::string>
      lanes_;  // variables of vectorized loops, and lets that depend on them
  std::unordered_set<std::string> forbidden_;
  std::set<std::string> complete_, on_device_;
  int kernels_ = 0, waiting_ = 0;  // around: loops of kernels, storage that is never skipped

  // State within one expression.
  std::set<std::pair<const ExprNode*, int>> seen_;
  std::unordered_set<std::string> let_names_;
  int choices_ = 0, arms_ = 0;
  size_t outside_ = 0;  // number of conditions in force around it
};

}  // namespace

StageGuards find_stage_guards(const Stmt& s, FunctionRef<bool(const std::string&)> may_skip) {
  return NeedFinder(may_skip).find(s);
}

}  // namespace retrograde::lower
