// partition_loops -- split loops so that likely() conditions vanish from most of their iterations.
// In:  Loops or FlatStorage, before unrolling and vectorization; names unique.
// Out: the same phase without likely markers; the same stores in the same order; names unique.
//
//   for (x, 0, w) {                            for (x.$1, 0, begin) {
//     out[x] = in[max(likely(x - 1), 0)]         out[x.$1] = in[max(x.$1 - 1, 0)]
//   }                                    =>    }
//                                              for (x, begin, end - begin) { out[x] = in[x - 1] }
//
// with  let begin = clamp(1, 0, w), let end = w,  and an epilogue if there is an upper limit. A parallel loop, or one
// whose borders are as large as tiles, stays one loop with an if inside. If the order of iterations is free, as in a
// pure definition without sliding windows, both borders of a large body are one loop before the steady state: most of
// the code that LLVM compiles is borders. If the order is not free, a large body with loops in it also stays one
// loop with an if inside.
//
// Meaning of likely:  likely(c)                     c is true
//                     min(likely(a), b), max        the marked operand is the result
//                     select(c, likely(a), b)       the marked arm is the result
// A mark carries over through lets, arithmetic, min, max and select, so that max(min(likely(x), hi), lo) is x. Once a
// mark has decided a min, max or select, a remainder ends it: that a split's min(likely(xo*8), n - 8) is xo*8 says
// nothing about values computed modulo something from it.
//
// Method: outermost loop first. One walk over the body of a loop rewrites it as if its likely conditions held. It asks
//         analysis/linear.h where each condition holds: an interval of the loop variable that is valid for all
//         iterations of inner vectorized and unrolled loops and of loops with constant extents. For conditions over
//         lanes in a body that is not large, it is also valid for loops of unknown extent. Conditions without such an
//         interval stay. The steady state is the intersection of the intervals.
//         Inner loops are then partitioned in the steady state. They are also partitioned in the border if
//         the body is small and the border may be large (whole tiles) or is the first iteration of a sliding window.
//         Large bodies keep the branch between the first iteration and others.
//         A condition that an inner loop decides, too, is left to that loop if a copy of a large body would save only
//         one branch per row: for a loop over the rows of a strip, and for a long loop along a row beside rows of other
//         Funcs.
//         A loop is split only if the saving is worth the copies (`Saving` in steady_state.h), or if the schedule
//         requests it with Partition::Always.
// Not done: a scalar condition that both this loop and an inner loop of unknown extent decide is left to the inner
//         loop. If an end depends on the lane of an enclosing vectorized loop, the worst lane decides.
// Source: folklore (index-set splitting).
// Tests: test/golden/lower/partition_loops/, test/property/loop_passes_test.cpp.
#include "lower/statement_passes.h"

#include <string>
#include <unordered_set>

#include "ir/build.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "lower/loops/steady_state.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// Copies of a body with up to this many nodes are worthwhile for each operation saved per iteration.
constexpr int nodes_an_operation = 64;
// The same for each condition over lanes, which is a gather or a select: LLVM compiles two copies of the body, one of
// them with the condition. Above this limit the condition is less than a hundredth of the work.
constexpr int nodes_a_vector_condition = 2048;

// Above this number of nodes, both borders of a body are one loop if their order is free, which saves a third of the
// code that LLVM compiles for a long pipeline. A smaller copy costs less than the choice between the two borders.
constexpr int joined_border = 60;

bool contains_likely(const Stmt& s) {
  return any_node(s, [](const Call& call) { return is_likely(&call); });
}

bool contains_loop(const Stmt& s) {
  return any_node(s, [](const For& loop) { return is_serial(loop); });
}

// "f" for a loop of its pure definition such as "f.s0.x"; otherwise empty.
std::string func_of_pure_loop(const std::string& loop) {
  const size_t stage = loop.find(".s0.");
  return stage == std::string::npos ? "" : loop.substr(0, stage);
}

// Whether the loop belongs to a pure definition, which writes each point once, and its body stores nothing else that
// later iterations could read.
bool runs_in_any_order(const For& loop) {
  const std::string func = func_of_pure_loop(loop.name);
  if (func.empty()) return false;
  std::unordered_set<std::string> own;
  bool result = true;
  const auto is_of_func = [&](const std::string& name) {
    return name == func || name.compare(0, func.size() + 1, func + ".") == 0;
  };
  walk(
      loop.body, [](const Expr&) { return true; },
      [&](const Stmt& s) {
        if (const auto* a = s.as<Allocate>()) own.insert(a->name);
        if (const auto* store = s.as<Store>())
          result &= is_of_func(store->name) || own.contains(store->name);
        result &= !s.as<Evaluate>() && !s.as<Provide>();
        return result;
      });
  return result;
}

class Partitioner : public StatementRewriter {
 public:
  explicit Partitioner(const Stmt& s) : fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const For* loop = s.as<For>()) return contains_likely(s) ? partition(s, *loop) : s;
    const LetStmt* let = s.as<LetStmt>();
    if (let && in_vectorized_ > 0) context_.add_let(let->name, let->value);
    return children(s);
  }

 private:
  Stmt partition(const Stmt& s, const For& loop) {
    if (!is_serial(loop)) return inside_lanes(s, loop);
    if (loop.partition == Partition::Never) return children(s);
    SteadyRewriter rewriter(loop, context_, in_vectorized_ > 0);
    Stmt body = rewriter(loop.body);
    const SteadyState& steady = rewriter.steady();
    if (steady.solved == 0 || !is_worth_copies(loop, steady.saving)) return children(s);
    Stmt rest = loop.body;
    if ((steady.has_thick_border || steady.has_warm_up) && node_count(rest) <= small_body)
      rest = (*this)(rest);
    return assemble(loop, (*this)(body), rest, steady);
  }

  static bool is_worth_copies(const For& loop, const Saving& saving) {
    if (saving.always_pays || loop.partition == Partition::Always) return true;
    if (saving.operations == 0 && saving.over_lanes == 0) return false;
    return saving.divides ||
           node_count(loop.body) <= nodes_an_operation * saving.operations +
                                        nodes_a_vector_condition * saving.over_lanes;
  }

  // Handles a vectorized loop. Loops inside it have the same bounds in all lanes.
  Stmt inside_lanes(const Stmt& s, const For& loop) {
    context_.add_loop(loop);
    ++in_vectorized_;
    Stmt result = children(s);
    if (--in_vectorized_ == 0) context_ = {};  // its names are not visible outside
    return result;
  }

  struct Ends {
    Expr begin, end;  // of the steady state; undefined where they coincide with those of the loop
    Expr needed;      // a further condition for the steady state; undefined: none
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
    ends.needed = steady.needed;
    // They are computed before the loop, outside of guards inside it that make promises true.
    for (Expr* e : {&ends.begin, &ends.end, &ends.needed})
      if (e->defined()) *e = without_promises(*e);
    return ends;
  }

  Stmt assemble(const For& loop, const Stmt& steady_body, const Stmt& rest,
                const SteadyState& steady) {
    Ends ends = find_ends(loop, steady);
    if (!ends.begin.defined() && !ends.end.defined() && !ends.needed.defined()) {
      return make_for(loop.name, loop.min, loop.extent, loop.runs, steady_body);
    }
    const bool stays_one = runs_at_once(loop.runs) || steady.has_thick_border ||
                           has_costly_borders_in_order(loop, rest, ends);
    return stays_one ? branch_inside(loop, steady_body, rest, ends)
                     : three_loops(loop, steady_body, rest, ends);
  }

  // If the borders must run in order, they would be two copies of the body; a branch costs little beside a large body.
  static bool has_costly_borders_in_order(const For& loop, const Stmt& rest, const Ends& ends) {
    return ends.begin.defined() && ends.end.defined() && contains_loop(rest) &&
           node_count(rest) > costly_border && !runs_in_any_order(loop);
  }

  Stmt branch_inside(const For& loop, const Stmt& steady_body, const Stmt& rest, const Ends& ends) {
    Expr var = variable(loop.name, loop.min.type());
    std::vector<Expr> conditions;
    Lets lets;
    auto bind = [&](const char* what, const Expr& value) -> Expr {
      if (is_const(value) || value.as<Variable>()) return value;
      lets.emplace_back(fresh_(loop.name + what), value);
      return variable(lets.back().first, value.type());
    };
    if (ends.begin.defined()) conditions.push_back(var >= bind(".begin", ends.begin));
    if (ends.end.defined()) conditions.push_back(var < bind(".end", ends.end));
    if (ends.needed.defined()) conditions.push_back(bind(".steady", ends.needed));
    Stmt body = make_if(conjunction(conditions), steady_body, copy_statement(rest, fresh_));
    return make_lets(lets, make_for(loop.name, loop.min, loop.extent, loop.runs, body));
  }

  // Ensures loop.min <= begin <= end <= loop_end for every extent of the loop.
  Stmt three_loops(const For& loop, const Stmt& steady_body, const Stmt& rest, const Ends& ends) {
    Expr loop_end = simplify(binary(Kind::Add, loop.min, loop.extent));
    std::string begin_name = fresh_(loop.name + ".begin"), end_name = fresh_(loop.name + ".end");
    bool has_prologue = ends.begin.defined();
    Expr begin = has_prologue ? variable(begin_name, loop.min.type()) : loop.min;
    Expr end = ends.end.defined() ? simplify(min(ends.end, loop_end)) : loop_end;
    if (ends.needed.defined()) end = make_select(ends.needed, end, begin);
    bool has_epilogue = ends.end.defined() || ends.needed.defined();
    Expr end_value = simplify(max(end, begin));
    if (has_epilogue) end = variable(end_name, loop.min.type());

    std::vector<Stmt> loops;
    if (has_prologue && has_epilogue && node_count(rest) > joined_border &&
        runs_in_any_order(loop)) {
      loops.push_back(both_borders(loop, begin, end, loop_end, rest));
      has_prologue = has_epilogue = false;
    }
    if (has_prologue) loops.push_back(border_loop(loop, loop.min, begin, rest));
    loops.push_back(make_for(loop.name, begin, simplify(end - begin), loop.runs, steady_body));
    if (has_epilogue) loops.push_back(border_loop(loop, end, loop_end, rest));
    Stmt result = make_block(std::move(loops));
    if (end.as<Variable>() && uses_variable(result, end_name))
      result = make_let(end_name, end_value, result);
    if (!ends.begin.defined()) return result;
    return make_let(begin_name, simplify(max(min(ends.begin, loop_end), loop.min)), result);
  }

  Stmt border_loop(const For& loop, const Expr& begin, const Expr& end, const Stmt& body) {
    return copy_statement(make_for(loop.name, begin, simplify(end - begin), loop.runs, body),
                          fresh_);
  }

  // One loop over border = 0, 1, ..., which enumerates [loop.min, begin) and then [end, loop_end).
  Stmt both_borders(const For& loop, const Expr& begin, const Expr& end, const Expr& loop_end,
                    const Stmt& body) {
    const Type type = loop.min.type();
    const Expr before = simplify(begin - loop.min);
    const Expr border = variable(loop.name + ".border", type);
    const Expr place = make_select(border < before, border + loop.min, border + (end - before));
    return copy_statement(
        make_for(loop.name + ".border", make_zero(type), simplify(before + (loop_end - end)),
                 loop.runs, make_let(loop.name, simplify(place), body)),
        fresh_);
  }

  FreshNames fresh_;
  PartitionContext context_;
  int in_vectorized_ = 0;
};

}  // namespace

Stmt partition_loops(const Stmt& s) {
  if (!s.defined() || !contains_likely(s)) return s;
  return without_likely(Partitioner(s)(s));
}

}  // namespace retrograde::lower
