// merge_equal_loops -- a condition that only decides how often a loop runs becomes a part of its extent.
// In:  FlatStorage, after trim_loops, before unrolling and vectorization; names unique.
// Out: the same phase; the same stores in the same order; names unique.
//
//   if (piece < 12) {                           let i.end = 6250 - piece * 512
//     for (i, 0, 512) { body }                  for (i, 0, select(piece < 12, 512, i.end)) { body }
//   } else {                            =>
//     let i.end = 6250 - piece * 512
//     for (i.$2, 0, i.end) { body.$2 }
//   }
//
// partition_loops makes two copies of a body to remove a guard from one of them. If trim_loops then turns the guard of
// the other copy into the bounds of its loop, the copies are equal, and compiling one of them takes half of the time.
//
// Method: compares the bodies up to names. Lets before the second loop move out of the condition if they neither load
//         nor call anything. Loops of that arm that provably never run, which a trimmed border leaves, are dropped, and
//         so are conditions that its new bounds decide.
// Not done: small bodies, for which a constant extent is worth a copy; several loops in an arm.
// Tests: test/golden/lower/merge_equal_loops/, test/property/loop_passes_test.cpp.
#include <unordered_set>

#include "analysis/interval.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/lets.h"
#include "ir/node_count.h"
#include "lower/loops/steady_state.h"
#include "lower/statement_passes.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

std::unordered_set<std::string> bound_in(const Stmt& s) {
  std::unordered_set<std::string> names;
  walk(
      s, [&](const Let& n) { names.insert(n.name); },
      [&](const LetStmt& n) { names.insert(n.name); }, [&](const For& n) { names.insert(n.name); },
      [&](const Allocate& n) { names.insert(n.name); },
      [&](const ProducerConsumer& n) { names.insert(n.name); });
  return names;
}

// Whether the bodies do the same, where the variable of one loop stands for that of the other.
bool have_equal_bodies(const For& a, const For& b) {
  const auto names = renaming(a.body, b.body, {{a.name, b.name}});
  if (!names) return false;
  const std::unordered_set<std::string> bound = bound_in(a.body);
  return std::ranges::all_of(*names, [&](const auto& pair) {
    return pair.first == pair.second || pair.first == a.name || bound.contains(pair.first);
  });
}

bool may_move(const Expr& value) {
  return value.type().is_int_or_uint() && value.type().is_scalar() &&
         !any_node(
             value, [](const Load&) { return true; }, [](const Call&) { return true; });
}

Expr expanded(Expr e, const Lets& lets) {
  for (auto let = lets.rbegin(); let != lets.rend(); ++let)
    e = substitute(e, let->first, let->second);
  return e;
}

bool never_runs(const For& loop, const Lets& lets) {
  const Expr extent = expanded(loop.extent, lets);
  return can_prove(extent <= make_zero(extent.type()));
}

// Drops conditions of a loop that hold in all of its iterations, such as that a lane of its last vector is inside.
class DecidedGuards : public StatementRewriter {
 public:
  explicit DecidedGuards(const Lets& lets) : lets_(lets) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const auto* loop = s.as<For>()) return in_loop(s, *loop);
    const auto* n = s.as<IfThenElse>();
    if (n && !n->when_false.defined() && always_holds(n->condition)) return (*this)(n->when_true);
    return children(s);
  }

 private:
  Stmt in_loop(const Stmt& s, const For& loop) {
    // Where there is an iteration, the extent is positive, so max(extent, 0) is the extent.
    Expr extent = expanded(loop.extent, lets_);
    const auto* positive = extent.as<Binary>();
    if (positive && positive->kind == Kind::Max && is_zero(positive->b)) extent = positive->a;
    bounds_.push(loop.name, {bounds_of(loop.min, bounds_).min,
                             bounds_of(loop.min + extent - make_one(extent.type()), bounds_).max});
    const Stmt result = children(s);
    bounds_.pop(loop.name);
    return result;
  }

  bool always_holds(const Expr& condition) const {
    const auto* n = condition.as<Binary>();
    if (!n || n->a.type() != Int(32)) return false;
    if (n->kind == Kind::LT) return is_negative(n->a - n->b);
    if (n->kind == Kind::LE) return is_negative(n->a - n->b - 1);
    return false;
  }
  bool is_negative(const Expr& e) const {
    const Expr most = bounds_of(simplify(e), bounds_).max;
    return most.defined() && can_prove(most < 0);
  }

  const Lets& lets_;
  Scope<Interval> bounds_;
};

// The only loop below lets that may run; null if there is another statement, or a let that has to stay.
const For* loop_below_lets(const Stmt& s, Lets& lets) {
  const Stmt* inner = &s;
  for (const auto* let = inner->as<LetStmt>(); let; let = inner->as<LetStmt>()) {
    if (!may_move(let->value)) return nullptr;
    lets.emplace_back(let->name, let->value);
    inner = &let->body;
  }
  const auto* block = inner->as<Block>();
  const For* only = nullptr;
  for (const Stmt& part : block ? block->stmts : std::vector<Stmt>{*inner}) {
    const For* loop = part.as<For>();
    if (loop && never_runs(*loop, lets)) continue;
    if (!loop || only) return nullptr;
    only = loop;
  }
  return only;
}

// Undefined: the arms differ in more than an extent.
Stmt merged(const IfThenElse& n) {
  if (!n.when_false.defined()) return {};
  Lets lets;
  const For* a = n.when_true.as<For>();
  const For* loop = a ? loop_below_lets(n.when_false, lets) : nullptr;
  if (!loop || !is_serial(*a) || a->runs != loop->runs || !equal(a->min, loop->min) ||
      has_at_most_nodes(a->body, costly_border))
    return {};
  const Stmt other = DecidedGuards(lets)(Stmt(loop));
  const For* b = other.as<For>();
  if (!have_equal_bodies(*a, *b)) return {};
  const Expr extent = make_select(n.condition, a->extent, b->extent);
  return make_lets(lets, make_for(a->name, a->min, extent, a->runs, a->body, a->partition));
}

}  // namespace

Stmt merge_equal_loops(const Stmt& s) {
  return rewrite_statements(s, [](const Stmt& part, auto& all) {
    const Stmt inner = all.children(part);
    const auto* choice = inner.as<IfThenElse>();
    const Stmt one = choice ? merged(*choice) : Stmt();
    return one.defined() ? one : inner;
  });
}

}  // namespace retrograde::lower
