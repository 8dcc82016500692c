// trim_loops -- turn conditions on a loop's variable into bounds of the loop.
// In:  Loops or FlatStorage, before unrolling and vectorization; names unique.
// Out: the same phase; the same stores in the same order; names unique.
//
//   for (r, 0, 130) {                         let r.end = min(n - 130*y, 130)
//     if (130*y + r < n && x < 62) {    =>    for (r, 0, max(r.end, 0)) {
//       out[x] = out[x] + in[r]                if (x < 62) { out[x] = out[x] + in[r] }
//     }                                      }
//   }
//
// In turn, (x < 62) bounds the loop over x. Gathers over non-rectangular domains, and where() of a user's RDom, look
// like this. A loop-invariant condition moves around the loop. Statements before the condition are allowed if they
// only fill memory that each iteration allocates, because only the guarded statement reads it. The last tile of a
// split with a guard thus computes no more of its producers than it needs.
//
// Method: a loop is trimmed if the condition guards its whole body (looking through lets, allocations, inner loops and
//         further conditions without an else), except for statements that only fill the allocations inside. Each
//         conjunct is brought into the form  c*v + rest >= 0  with a constant c, and with a rest that mentions
//         neither the loop's variable v nor names bound inside the loop. It is equivalent to v >= -floor(rest / c), or
//         to v <= floor(rest / -c), and becomes a bound. A conjunct without v and names bound inside moves around the
//         loop. Loops with a small constant extent keep their bounds: they are unrolled with their conditions.
// Not done: bounds that depend on the lane of an enclosing vectorized loop; several statements, each under its own
//           condition.
// Source: folklore (loop bounds from guards). Tests: test/golden/lower/trim_loops/,
// test/property/loop_passes_test.cpp.
#include "lower/statement_passes.h"

#include <unordered_set>

#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "lower/loops/only_fills.h"
#include "lower/loops/steady_state.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// Loops with constant extents up to this one keep their bounds.
constexpr int64_t untrimmed_iterations = 16;

bool may_end_elsewhere(const For& loop) {
  const auto extent = as_const_int(loop.extent);
  return !extent || *extent > untrimmed_iterations;
}

// Removes conditions on one loop from its body.
class Trimmer {
 public:
  // `lanes`: names whose value differs between the lanes of a vectorized loop around.
  Trimmer(const For& loop, const std::unordered_set<std::string>& lanes)
      : loop_(loop), lanes_(lanes) {}

  Stmt trim(const Stmt& s) {
    return match(
        s,
        [&](const LetStmt& n) {
          note_let(n);
          return with_body(s, n.body);
        },
        [&](const For& n) {
          unusable_.insert(n.name);
          return with_body(s, n.body);
        },
        [&](const Allocate& n) {
          own_.insert(n.name);
          return with_body(s, n.body);
        },
        [&](const ProducerConsumer& n) { return with_body(s, n.body); },
        [&](const Block& n) {
          Stmt acting;
          for (const Stmt& part : n.stmts) {
            if (only_fills(part, own_)) continue;
            if (acting.defined()) return s;
            acting = part;
          }
          return acting.defined() ? with_body(s, acting) : s;
        },
        [&](const IfThenElse& n) {
          if (n.when_false.defined()) return s;
          Expr rest = without_ends(n.condition);
          Stmt body = trim(n.when_true);
          return with_parts(n, rest, body, {});
        },
        [&](const StmtNode&) { return s; });
  }

  // The loop with the trimmed body and its new bounds.
  Stmt assemble(const Stmt& body, FreshNames& fresh) const {
    Expr begin = loop_.min, end = binary(Kind::Add, loop_.min, loop_.extent);
    for (const Expr& e : begins_) begin = binary(Kind::Max, begin, e);
    for (const Expr& e : lasts_)
      end = binary(Kind::Min, end, binary(Kind::Add, e, make_one(e.type())));
    begin = simplify(begin);
    const Type type = begin.type();
    const bool is_simple = is_const(begin) || begin.as<Variable>();
    Expr from = is_simple ? begin : variable(fresh(loop_.name + ".begin"), type);
    Expr extent = simplify(max(binary(Kind::Sub, end, from), make_zero(type)));
    Stmt loop = make_for(loop_.name, from, extent, loop_.runs, body);
    if (!around_.empty()) loop = make_if(conjunction(around_), loop);
    return is_simple ? loop : make_let(from.as<Variable>()->name, begin, loop);
  }

  bool found() const { return !begins_.empty() || !lasts_.empty() || !around_.empty(); }

 private:
  Stmt with_body(const Stmt& s, const Stmt& body) {
    Stmt trimmed = trim(body);
    if (trimmed.same_as(body)) return s;
    return map_children(s,
                        [&](const Stmt& child) { return child.same_as(body) ? trimmed : child; });
  }

  // Lets whose value is not known outside are not expanded: the value would grow with each let that reads the one
  // before, and would be walked as often.
  void note_let(const LetStmt& let) {
    if (reads_memory(let.value, MemoryReads::Functions) ||
        uses_any_variable(let.value, unusable_)) {
      unusable_.insert(let.name);
    } else {
      lets_[let.name] = substitute(without_lets(let.value), lets_);
    }
  }

  // The condition without the conjuncts that became bounds or move around the loop.
  Expr without_ends(const Expr& condition) {
    if (condition.kind() == Kind::And) {
      const auto* both = condition.as<Binary>();
      Expr a = without_ends(both->a), b = without_ends(both->b);
      if (a.same_as(both->a) && b.same_as(both->b)) return condition;
      return is_const_true(a) ? b : is_const_true(b) ? a : binary(Kind::And, a, b);
    }
    if (const auto* let = condition.as<Let>())
      return without_ends(substitute(let->body, let->name, let->value));
    const Expr open = substitute(without_lets(condition), lets_);
    return goes_around(open) || becomes_end(open) ? const_true() : condition;
  }

  bool is_known_outside(const Expr& condition) const {
    return !reads_memory(condition, MemoryReads::Functions) &&
           !uses_any_variable(condition, unusable_) && !uses_any_variable(condition, lanes_);
  }

  bool goes_around(const Expr& condition) {
    if (!is_known_outside(condition) || uses_any_variable(condition, {loop_.name})) return false;
    around_.push_back(condition);
    return true;
  }

  bool becomes_end(const Expr& condition) {
    if (!may_end_elsewhere(loop_) || !is_known_outside(condition)) return false;
    auto form = nonnegative_where(condition);
    if (!form || form->type != loop_.min.type()) return false;
    const int64_t c = form->factor_of(loop_.name);
    if (c == 0) return false;
    Expr rest = to_expr(plus(*form, linear_sum(variable(loop_.name, form->type)), -c));
    if (!rest.defined() || uses_any_variable(rest, {loop_.name})) return false;
    Expr quotient = canonical_div(rest, c > 0 ? c : -c);
    if (c > 0) {
      begins_.push_back(simplify(binary(Kind::Sub, make_zero(quotient.type()), quotient)));
    } else {
      lasts_.push_back(simplify(quotient));
    }
    return true;
  }

  const For& loop_;
  const std::unordered_set<std::string>& lanes_;  // of the whole program, so kept by reference
  std::unordered_set<std::string> unusable_;      // names bound inside
  std::unordered_set<std::string> own_;           // allocations inside
  Substitution lets_;
  std::vector<Expr> begins_, lasts_;  // inclusive bounds of the variable
  std::vector<Expr> around_;          // conditions without the variable
};

}  // namespace

Stmt trim_loops(const Stmt& s) {
  FreshNames fresh(s);
  std::unordered_set<std::string> lanes;  // names are unique, so none is ever removed
  return rewrite_statements(s, [&](const Stmt& node, auto& all) {
    const auto* let = node.as<LetStmt>();
    if (let && uses_any_variable(let->value, lanes)) lanes.insert(let->name);
    const auto* loop = node.as<For>();
    if (!loop) return all.children(node);
    if (loop->runs == ForType::Vectorized) lanes.insert(loop->name);
    if (!is_serial(*loop)) return all.children(node);
    Trimmer trimmer(*loop, lanes);
    const Stmt body = trimmer.trim(loop->body);
    return trimmer.found() ? trimmer.assemble(all(body), fresh) : all.children(node);
  });
}

}  // namespace retrograde::lower
