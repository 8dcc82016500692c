// partition_loops -- split loops so that likely() conditions vanish from most of their iterations.
// In:  Loops or FlatStorage, before unrolling and vectorization; names unique.
// Out: the same phase without likely markers; the same stores in the same order; names unique.
//
//   for (x, 0, w) {                            for (x.$1, 0, begin) {
//     out[x] = in[max(likely(x - 1), 0)]         out[x.$1] = in[max(x.$1 - 1, 0)]
//   }                                    =>    }
//                                              for (x, begin, end - begin) { out[x] = in[x - 1] }
//
// with  let begin = clamp(1, 0, w), let end = w,  and an epilogue where there is an upper limit. A
// parallel loop, and one whose borders are as large as tiles, stays one loop, with an if inside.
//
// What likely says:  likely(c)                     c is true
//                    min(likely(a), b), max        the marked operand is the result
//                    select(c, likely(a), b)       the marked arm is the result
// A marked value stays marked through lets, arithmetic, min, max and select, so that
// max(min(likely(x), hi), lo) is x. Once a min, max or select was decided by a mark, arithmetic
// ends it: that a split's min(likely(xo*8), n - 8) is xo*8 says nothing of what is computed from
// there.
//
// Method: outermost loop first. One walk over the body of a loop rewrites it as if its likely
//         conditions held, and asks analysis/linear.h where each of them holds: an interval of the
//         loop variable, for all values of inner vectorized and unrolled loops and of loops with
//         constant extents. Conditions without such an interval stay. The intersection of the
//         intervals is the steady state. Inner loops are then partitioned in the steady state
//         only; in the rest too where the rest may be large (a border of whole tiles) and the body
//         is small.
// Not done: a condition that both this loop and an inner loop of unknown extent decide: it is left
//         to the inner loop. Ends that depend on the lane of an enclosing vectorized loop: the
//         worst lane decides.
// Source: folklore (index-set splitting).
// Tests: test/golden/lower/partition_loops/, test/property/loop_passes_test.cpp.
#include "lower/partition_loops.h"

#include <algorithm>
#include <unordered_map>

#include "analysis/interval.h"
#include "analysis/linear.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/copy_statement.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

// Border bodies with more nodes than this are not partitioned further.
constexpr int small_body = 1500;
// A border is thick when the inner loops that a condition is about run a serial loop of at least
// this extent, ...
constexpr int64_t thick_loop = 8;
// ... and at least this many points in all: a tile then, and not a stencil or a vector.
constexpr int64_t thick_points = 32;

bool is_likely(const Call* call) {
  return call && (call->is_op(Op::likely) || call->is_op(Op::likely_if_innermost));
}

bool contains_likely(const Stmt& s) {
  bool found = false;
  walk(
      s,
      [&](const Expr& e) {
        found |= is_likely(e.as<Call>());
        return !found;
      },
      [&](const Stmt&) { return !found; });
  return found;
}

class MarkerRemover : public Rewriter {
 protected:
  Expr rewrite(const Expr& e) override {
    Expr copy = children(e);
    const Call* call = copy.as<Call>();
    return is_likely(call) ? call->args[0] : copy;
  }
  Stmt rewrite(const Stmt& s) override { return children(s); }
};

int node_count(const Stmt& s) {
  int count = 0;
  auto visit = [&](const auto&) { return ++count, true; };
  walk(
      s, [&](const Expr& e) { return visit(e); }, [&](const Stmt& child) { return visit(child); });
  return count;
}

bool is_serial(const For& loop) {
  return loop.for_type == ForType::Serial || loop.for_type == ForType::Parallel;
}

// Names whose values a solution may not mention: what a let stands for, and between what a loop
// variable lies.
class Context {
 public:
  void add_let(const std::string& name, const Expr& value) {
    if (is_pure(value)) {
      lets_[name] = expand(value);
    } else {
      ranges_.push(name, Interval::everything());
    }
  }
  void add_range(const std::string& name, const Interval& range) { ranges_.push(name, range); }
  void add_loop(const For& loop) {
    Expr last =
        binary(Kind::Sub, binary(Kind::Add, loop.min, loop.extent), make_one(loop.min.type()));
    add_range(loop.name,
              {bounds_of(expand(loop.min), ranges_).min, bounds_of(expand(last), ranges_).max});
  }
  // Without lets and markers.
  Expr expand(const Expr& e) const { return MarkerRemover()(substitute(e, lets_)); }
  const Scope<Interval>& ranges() const { return ranges_; }

 private:
  static bool is_pure(const Expr& e) {
    if (!e.type().is_int_or_uint() || !e.type().is_scalar()) return false;
    bool pure = true;
    walk(e, [&](const Expr& node) {
      const Call* call = node.as<Call>();
      pure &= node.kind() != Kind::Load && node.kind() != Kind::Let;
      pure &= !call ||
              (call->call_type == CallType::Operator && op_info(call->op).cls != OpClass::Effect);
      return pure;
    });
    return pure;
  }

  Substitution lets_;
  Scope<Interval> ranges_;
};

// Where the steady state of one loop lies.
struct SteadyState {
  Interval range;                 // of the loop variable
  Expr needed;                    // and only if this holds; undefined: always
  bool has_thick_border = false;  // some iteration of the rest is a tile or more
  int solved = 0;
};

// Rewrites the body of a loop for its steady state, and finds where that lies.
class SteadyRewriter : public Rewriter {
 public:
  SteadyRewriter(const For& loop, const Context& outer)
      : loop_(loop), context_(outer), dependent_{loop.name} {}
  const SteadyState& steady() const { return steady_; }

 protected:
  Expr rewrite(const Expr& e) override {
    if (const Let* n = e.as<Let>()) return rewrite_let(e, *n);
    if (const Variable* v = e.as<Variable>()) {
      auto it = decided_lets_.find(v->name);
      return it == decided_lets_.end() ? e : it->second;
    }
    Expr copy = children(e);
    if (const Call* n = e.as<Call>(); is_likely(n) && e.type().is_bool() && is_mark(*n)) {
      return holds(copy.as<Call>()->args[0], true) ? const_true() : copy;
    }
    if (e.kind() == Kind::Min || e.kind() == Kind::Max)
      return rewrite_extreme(*e.as<Binary>(), copy);
    if (const Select* n = e.as<Select>()) return rewrite_select(*n, copy);
    return copy;
  }

  Stmt rewrite(const Stmt& s) override {
    if (const LetStmt* n = s.as<LetStmt>()) {
      Expr value = bind(n->name, n->value);
      Stmt body = (*this)(n->body);
      return value.same_as(n->value) && body.same_as(n->body) ? s : make_let(n->name, value, body);
    }
    if (const For* n = s.as<For>()) return rewrite_loop(s, *n);
    Stmt copy = children(s);
    const IfThenElse* n = copy.defined() ? copy.as<IfThenElse>() : nullptr;
    if (n && is_const_true(n->condition)) return n->then_case;
    if (n && is_const_false(n->condition)) return n->else_case;
    return copy;
  }

 private:
  Expr rewrite_let(const Expr& e, const Let& n) {
    Expr value = bind(n.name, n.value);
    Expr body = (*this)(n.body);
    return value.same_as(n.value) && body.same_as(n.body) ? e : make_let(n.name, value, body);
  }

  // The value of a let. Marks and decided conditions go on into the body.
  Expr bind(const std::string& name, const Expr& original) {
    Expr value = (*this)(original);
    context_.add_let(name, value);
    marked_lets_[name] = mark(original);
    if (is_const(value) && !value.same_as(original)) decided_lets_[name] = value;
    return value;
  }

  // Inner loops of unknown extent keep their variables to themselves.
  Stmt rewrite_loop(const Stmt& s, const For& n) {
    auto extent = as_const_int(simplify(n.extent));
    if (!is_serial(n) || extent) {
      inner_extents_[n.name] = extent.value_or(1);
      context_.add_loop(n);
      if (uses_any_variable(context_.expand(n.min), dependent_)) dependent_.insert(n.name);
    } else {
      context_.add_range(n.name, Interval::everything());
    }
    if (is_serial(n)) inner_serial_.insert(n.name);
    Stmt copy = children(s);
    return copy;
  }

  Expr rewrite_extreme(const Binary& n, const Expr& copy) {
    const Binary* op = copy.as<Binary>();
    const Mark a_mark = mark(n.a), b_mark = mark(n.b);
    if (a_mark == b_mark || !op || copy.kind() != n.kind) return copy;
    const Expr& kept = a_mark > b_mark ? op->a : op->b;
    const Expr& other = a_mark > b_mark ? op->b : op->a;
    bool decided = holds(binary(n.kind == Kind::Min ? Kind::LE : Kind::GE, kept, other), true);
    return decided ? kept : copy;
  }

  Expr rewrite_select(const Select& n, const Expr& copy) {
    const Select* op = copy.as<Select>();
    const Mark t_mark = mark(n.true_value), f_mark = mark(n.false_value);
    if (t_mark == f_mark || !op) return copy;
    if (!holds(op->condition, t_mark > f_mark)) return copy;
    return t_mark > f_mark ? op->true_value : op->false_value;
  }

  // ---- marks ----

  bool is_mark(const Call& call) const { return call.is_op(Op::likely) || inner_serial_.empty(); }

  // In the order of what wins.
  enum class Mark : uint8_t { None, Decided, Likely };

  // Whether e is computed from something marked, not counting what it loads.
  Mark mark(const Expr& e) {
    if (auto it = marks_.find(e.get()); it != marks_.end()) return it->second;
    const auto decided = [&](const Expr& a, const Expr& b) {
      return std::max(mark(a), mark(b)) == Mark::None ? Mark::None : Mark::Decided;
    };
    const auto arithmetic = [&](const Binary& n) {
      if (n.type.is_bool()) return Mark::None;
      if (n.kind == Kind::Min || n.kind == Kind::Max) return decided(n.a, n.b);
      const Mark strongest = std::max(mark(n.a), mark(n.b));
      return n.kind == Kind::Mod && strongest == Mark::Decided ? Mark::None : strongest;
    };
    const Mark result = match(
        e,
        [&](const Variable& n) {
          auto it = marked_lets_.find(n.name);
          return it == marked_lets_.end() ? Mark::None : it->second;
        },
        [&](const Call& n) {
          if (is_likely(&n)) return is_mark(n) ? Mark::Likely : mark(n.args[0]);
          bool is_promise = n.is_op(Op::promise_clamped) || n.is_op(Op::unsafe_promise_clamped);
          return is_promise ? mark(n.args[0]) : Mark::None;
        },
        [&](const Cast& n) { return mark(n.value); }, [&](const Let& n) { return mark(n.body); },
        [&](const Select& n) { return decided(n.true_value, n.false_value); }, arithmetic,
        [&](const ExprNode&) { return Mark::None; });
    marks_.emplace(e.get(), result);
    return result;
  }

  // ---- conditions ----

  // Whether the steady state can be where the condition is `is_true`; then it is from now on.
  bool holds(const Expr& condition, bool is_true) {
    Expr expanded = context_.expand(is_true ? condition : logical_not(condition));
    if (!uses_any_variable(expanded, dependent_)) return false;
    auto solution = solve_for(expanded, loop_.name, context_.ranges());
    if (!solution) return false;
    ++steady_.solved;
    steady_.range = intersection(steady_.range, solution->interval);
    if (solution->needed.defined()) {
      steady_.needed = steady_.needed.defined()
                           ? binary(Kind::And, steady_.needed, solution->needed)
                           : solution->needed;
    }
    steady_.has_thick_border |= is_about_tiles(expanded);
    return true;
  }

  bool is_about_tiles(const Expr& condition) const {
    std::unordered_set<std::string> names;
    walk(condition, [&](const Expr& e) {
      if (const Variable* v = e.as<Variable>()) names.insert(v->name);
      return true;
    });
    int64_t points = 1, longest = 0;
    for (const std::string& name : names) {
      auto it = inner_extents_.find(name);
      if (it == inner_extents_.end()) continue;
      points *= it->second;
      if (inner_serial_.count(name)) longest = std::max(longest, it->second);
    }
    return longest >= thick_loop && points >= thick_points;
  }

  const For& loop_;
  Context context_;
  SteadyState steady_;
  std::unordered_set<std::string>
      dependent_;  // the loop's variable, and those of inner loops that start from it
  std::unordered_set<std::string> inner_serial_;
  std::unordered_map<std::string, int64_t> inner_extents_;  // constant ones
  std::unordered_map<std::string, Mark> marked_lets_;
  std::unordered_map<std::string, Expr> decided_lets_;
  std::unordered_map<const ExprNode*, Mark> marks_;  // of nodes of the body, which outlives this
};

class Partitioner : public Rewriter {
 public:
  explicit Partitioner(const Stmt& s) : fresh_(s) {}

 protected:
  Expr rewrite(const Expr& e) override { return e; }

  Stmt rewrite(const Stmt& s) override {
    if (const For* loop = s.as<For>()) return contains_likely(s) ? partition(s, *loop) : s;
    const LetStmt* let = s.as<LetStmt>();
    if (let && in_vectorized_ > 0) context_.add_let(let->name, let->value);
    return children(s);
  }

 private:
  Stmt partition(const Stmt& s, const For& loop) {
    if (!is_serial(loop)) return inside_lanes(s, loop);
    SteadyRewriter rewriter(loop, context_);
    Stmt body = rewriter(loop.body);
    const SteadyState& steady = rewriter.steady();
    if (steady.solved == 0) return children(s);
    Stmt rest = loop.body;
    if (steady.has_thick_border && node_count(rest) <= small_body) rest = (*this)(rest);
    return assemble(loop, (*this)(body), rest, steady);
  }

  // Loops inside a vectorized one have the same bounds in all lanes.
  Stmt inside_lanes(const Stmt& s, const For& loop) {
    context_.add_loop(loop);
    ++in_vectorized_;
    Stmt result = children(s);
    --in_vectorized_;
    return result;
  }

  struct Ends {
    Expr begin, end;  // of the steady state; undefined where it begins or ends with the loop
  };

  static Ends find_ends(const For& loop, const SteadyState& steady) {
    Expr loop_end = simplify(binary(Kind::Add, loop.min, loop.extent));
    Ends ends;
    const Interval& range = steady.range;
    if (range.min.defined()) ends.begin = simplify(range.min);
    if (range.max.defined())
      ends.end = simplify(binary(Kind::Add, range.max, make_one(range.max.type())));
    if (ends.begin.defined() && can_prove(ends.begin <= loop.min)) ends.begin = {};
    if (ends.end.defined() && can_prove(ends.end >= loop_end)) ends.end = {};
    return ends;
  }

  Stmt assemble(const For& loop, const Stmt& steady_body, const Stmt& rest,
                const SteadyState& steady) {
    Ends ends = find_ends(loop, steady);
    if (!ends.begin.defined() && !ends.end.defined() && !steady.needed.defined()) {
      return make_for(loop.name, loop.min, loop.extent, loop.for_type, steady_body);
    }
    bool stays_one = loop.for_type == ForType::Parallel || steady.has_thick_border;
    return stays_one ? branch_inside(loop, steady_body, rest, ends, steady.needed)
                     : three_loops(loop, steady_body, rest, ends, steady.needed);
  }

  Stmt branch_inside(const For& loop, const Stmt& steady_body, const Stmt& rest, const Ends& ends,
                     const Expr& needed) {
    Expr var = variable(loop.name, loop.min.type());
    std::vector<Expr> conditions;
    std::vector<std::pair<std::string, Expr>> lets;
    auto bind = [&](const char* what, const Expr& value) -> Expr {
      if (is_const(value) || value.as<Variable>()) return value;
      lets.emplace_back(fresh_(loop.name + what), value);
      return variable(lets.back().first, value.type());
    };
    if (ends.begin.defined()) conditions.push_back(var >= bind(".begin", ends.begin));
    if (ends.end.defined()) conditions.push_back(var < bind(".end", ends.end));
    if (needed.defined()) conditions.push_back(bind(".steady", needed));
    Stmt body = make_if(conjunction(conditions), steady_body, copy_statement(rest, fresh_));
    Stmt result = make_for(loop.name, loop.min, loop.extent, loop.for_type, body);
    for (size_t i = lets.size(); i-- > 0;) result = make_let(lets[i].first, lets[i].second, result);
    return result;
  }

  // loop.min <= begin <= end <= loop_end, whatever the loop's extent.
  Stmt three_loops(const For& loop, const Stmt& steady_body, const Stmt& rest, const Ends& ends,
                   const Expr& needed) {
    Expr loop_end = simplify(binary(Kind::Add, loop.min, loop.extent));
    std::string begin_name = fresh_(loop.name + ".begin"), end_name = fresh_(loop.name + ".end");
    bool has_prologue = ends.begin.defined();
    Expr begin = has_prologue ? variable(begin_name, loop.min.type()) : loop.min;
    Expr end = ends.end.defined() ? simplify(min(ends.end, loop_end)) : loop_end;
    if (needed.defined()) end = make_select(needed, end, begin);
    bool has_epilogue = ends.end.defined() || needed.defined();
    Expr end_value = simplify(max(end, begin));
    if (has_epilogue) end = variable(end_name, loop.min.type());

    std::vector<Stmt> loops;
    if (has_prologue) loops.push_back(border_loop(loop, loop.min, begin, rest));
    loops.push_back(make_for(loop.name, begin, simplify(end - begin), loop.for_type, steady_body));
    if (has_epilogue) loops.push_back(border_loop(loop, end, loop_end, rest));
    Stmt result = make_block(std::move(loops));
    if (has_epilogue) result = make_let(end_name, end_value, result);
    if (!has_prologue) return result;
    return make_let(begin_name, simplify(max(min(ends.begin, loop_end), loop.min)), result);
  }

  Stmt border_loop(const For& loop, const Expr& begin, const Expr& end, const Stmt& body) {
    return copy_statement(make_for(loop.name, begin, simplify(end - begin), loop.for_type, body),
                          fresh_);
  }

  FreshNames fresh_;
  Context context_;
  int in_vectorized_ = 0;
};

}  // namespace

Stmt partition_loops(const Stmt& s) {
  if (!s.defined() || !contains_likely(s)) return s;
  return MarkerRemover()(Partitioner(s)(s));
}

}  // namespace retrograde::ir
