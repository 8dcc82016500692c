#include "lower/loops/steady_state.h"

#include <algorithm>

#include "analysis/linear.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// A border is thick if the inner loops in a condition include a serial loop of at least this extent, ...
constexpr int64_t thick_loop = 8;
// ... and run at least this many points in total: a tile, and not a stencil or a vector.
constexpr int64_t thick_points = 32;
// From this extent on, the borders of an inner loop cost little in comparison with it.
constexpr int64_t long_row = 16;

// The maximum number of iterations of a short loop. A loop of varying extent inside unrolled code, for example one that
// prepares data for the copies, does not count as a loop if it is that short.
constexpr int short_iterations = 4;

bool is_short(const For& loop, const Substitution& lets) {
  return !is_const(loop.extent) &&
         can_prove(substitute(loop.extent, lets) <= Expr(short_iterations));
}

bool contains_serial_loop(const Stmt& s) {
  Substitution lets;
  return any_stmt(s, [&](const Stmt& part) {
    if (const auto* let = part.as<LetStmt>(); let && let->value.type() == Int(32))
      lets[let->name] = let->value;
    const For* loop = part.as<For>();
    return loop && is_serial(*loop) && !is_short(*loop, lets);
  });
}

// Whether there are several serial loops without others inside, such as rows of several Funcs.
bool has_several_rows(const Stmt& s) {
  int rows = 0;
  walk(
      s, [](const Expr&) { return false; },
      [&](const Stmt& part) {
        const For* loop = part.as<For>();
        rows += loop && is_serial(*loop) && !contains_serial_loop(loop->body);
        return rows < 2;
      });
  return rows >= 2;
}

bool is_pure(const Expr& e) {
  if (!e.type().is_int_or_uint() || !e.type().is_scalar()) return false;
  return !any_node(e, [](const Expr& node) {
    const Call* call = node.as<Call>();
    const bool is_pure_call = !call || (call->call_type == CallType::Operator &&
                                        op_info(call->op).cls != OpClass::Effect);
    return !is_pure_call || node.kind() == Kind::Load || node.kind() == Kind::Let;
  });
}

std::unordered_set<std::string> variables_of(const Expr& e) {
  std::unordered_set<std::string> names;
  walk(e, [&](const Variable& v) { names.insert(v.name); });
  return names;
}

}  // namespace

bool is_likely(const Call* call) {
  return call && (call->is_op(Op::likely) || call->is_op(Op::likely_if_innermost));
}

bool is_serial(const For& loop) {
  return loop.runs == ForType::Serial || loop.runs == ForType::Parallel;
}

void PartitionContext::add_let(const std::string& name, const Expr& value) {
  if (is_pure(value)) {
    lets_[name] = expand(value);
  } else {
    ranges_.push(name, Interval::everything());
  }
}

void PartitionContext::add_loop(const For& loop) {
  Expr last =
      binary(Kind::Sub, binary(Kind::Add, loop.min, loop.extent), make_one(loop.min.type()));
  add_range(loop.name,
            {bounds_of(expand(loop.min), ranges_).min, bounds_of(expand(last), ranges_).max});
}

int node_count(const Stmt& s) {
  int count = 0;
  const auto visit = [&](const auto&) { return ++count, true; };
  walk(
      s, [&](const Expr& e) { return visit(e); }, [&](const Stmt& child) { return visit(child); });
  return count;
}

SteadyRewriter::SteadyRewriter(const For& loop, const PartitionContext& outer, bool inside_lanes)
    : loop_(loop),
      context_(outer),
      inside_lanes_(inside_lanes),
      has_inner_loops_(contains_serial_loop(loop.body)),
      has_costly_rows_(has_several_rows(loop.body) && node_count(loop.body) > costly_border),
      partitions_borders_(node_count(loop.body) <= small_body),
      dependent_{loop.name} {}

Expr SteadyRewriter::rewrite(const Expr& e) {
  if (const Let* n = e.as<Let>()) return rewrite_let(e, *n);
  if (const Variable* v = e.as<Variable>()) return value_or(decided_lets_, v->name, e);
  Expr copy = children(e);
  if (const Call* n = e.as<Call>(); is_likely(n) && e.type().is_bool() && is_mark(*n)) {
    return holds(copy.as<Call>()->args[0], true, true) ? const_true() : copy;
  }
  if (e.kind() == Kind::Min || e.kind() == Kind::Max) return rewrite_extreme(*e.as<Binary>(), copy);
  if (const Select* n = e.as<Select>()) return rewrite_select(*n, copy);
  if (e.kind() == Kind::Div || e.kind() == Kind::Mod)
    steady_.saving.divides |= uses_any_variable(context_.expand(e), dependent_);
  return copy;
}

Stmt SteadyRewriter::rewrite(const Stmt& s) {
  if (const LetStmt* n = s.as<LetStmt>()) {
    return map_children(
        s, [&](const Expr& value) { return bind(n->name, value); }, *this);
  }
  if (const For* n = s.as<For>()) return rewrite_loop(s, *n);
  Stmt copy = children(s);
  const IfThenElse* n = copy.defined() ? copy.as<IfThenElse>() : nullptr;
  if (n && is_const_true(n->condition)) return n->when_true;
  if (n && is_const_false(n->condition)) return n->when_false;
  return copy;
}

Expr SteadyRewriter::rewrite_let(const Expr& e, const Let& n) {
  Expr value = bind(n.name, n.value);
  Expr body = (*this)(n.body);
  if (is_const(body)) return body;
  return value.same_as(n.value) && body.same_as(n.body) ? e : make_let(n.name, value, body);
}

// Rewrites the value of a let. Marks and decided conditions carry over to the body.
Expr SteadyRewriter::bind(const std::string& name, const Expr& original) {
  Expr value = (*this)(original);
  context_.add_let(name, value);
  marked_lets_[name] = mark(original);
  if (is_const(value) && !value.same_as(original)) decided_lets_[name] = value;
  return value;
}

Stmt SteadyRewriter::rewrite_loop(const Stmt& s, const For& n) {
  auto extent = as_const_int(simplify(n.extent));
  if (!is_serial(n) || extent) {
    inner_extents_[n.name] = extent.value_or(1);
    context_.add_loop(n);
    if (uses_any_variable(context_.expand(n.min), dependent_)) dependent_.insert(n.name);
  } else {
    context_.add_loop(n);
    of_unknown_extent_.insert(n.name);
  }
  if (n.runs == ForType::Vectorized) lanes_.insert(n.name);
  if (!is_serial(n)) return children(s);
  inner_serial_.insert(n.name);
  if (extent && decides_alone(n, *extent)) decide_alone_.insert(n.name);
  enclosing_.push_back(n.name);
  Stmt copy = children(s);
  enclosing_.pop_back();
  return copy;
}

// Whether an inner loop is left to partition itself. A copy of this loop's body would save only one branch per
// iteration of the inner loop, or, if other loops stand beside it, one per row.
bool SteadyRewriter::decides_alone(const For& n, int64_t extent) const {
  if (contains_serial_loop(n.body))
    return extent >= thick_loop && node_count(n.body) > costly_border;
  return extent >= long_row && has_costly_rows_;
}

Expr SteadyRewriter::rewrite_extreme(const Binary& n, const Expr& copy) {
  const Binary* op = copy.as<Binary>();
  const Mark a_mark = mark(n.a), b_mark = mark(n.b);
  if (a_mark == b_mark || !op || copy.kind() != n.kind) return copy;
  const Expr& kept = a_mark > b_mark ? op->a : op->b;
  const Expr& other = a_mark > b_mark ? op->b : op->a;
  const Kind comparison = n.kind == Kind::Min ? Kind::LE : Kind::GE;
  return holds(binary(comparison, kept, other), true, false) ? kept : copy;
}

Expr SteadyRewriter::rewrite_select(const Select& n, const Expr& copy) {
  const Select* op = copy.as<Select>();
  const Mark t_mark = mark(n.when_true), f_mark = mark(n.when_false);
  if (t_mark == f_mark || !op) return copy;
  if (!holds(op->condition, t_mark > f_mark, true)) return copy;
  return t_mark > f_mark ? op->when_true : op->when_false;
}

// Whether e is computed from a marked value; loaded values do not count.
SteadyRewriter::Mark SteadyRewriter::mark(const Expr& e) {
  if (const auto* it = find_or_null(marks_, e.get())) return *it;
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
      e, [&](const Variable& n) { return value_or(marked_lets_, n.name, Mark::None); },
      [&](const Call& n) {
        if (is_likely(&n)) return is_mark(n) ? Mark::Likely : mark(n.args[0]);
        bool is_promise = n.is_op(Op::promise_clamped) || n.is_op(Op::unsafe_promise_clamped);
        return is_promise ? mark(n.args[0]) : Mark::None;
      },
      [&](const Cast& n) { return mark(n.value); }, [&](const Let& n) { return mark(n.body); },
      [&](const Select& n) { return decided(n.when_true, n.when_false); }, arithmetic,
      [&](const ExprNode&) { return Mark::None; });
  marks_.emplace(e.get(), result);
  return result;
}

// Tries to restrict the steady state to iterations in which the condition is `is_true`; returns whether it did. A
// choice (`is_choice`) skips work, whereas a min or max saves a single operation.
bool SteadyRewriter::holds(const Expr& condition, bool is_true, bool is_choice) {
  Expr expanded = context_.expand(is_true ? condition : logical_not(condition));
  const std::unordered_set<std::string> names = variables_of(expanded);
  const auto is_in = [&](const std::string& name) { return names.count(name) != 0; };
  if (std::ranges::none_of(dependent_, is_in)) return false;
  if (std::ranges::any_of(decide_alone_, is_in)) return false;
  const bool is_over_unknown = std::ranges::any_of(of_unknown_extent_, is_in);
  const bool is_over_lanes = inside_lanes_ || std::ranges::any_of(lanes_, is_in);
  // If inner loops are long, all iterations may be border, so the border must be partitioned, too.
  if (is_over_unknown && !(is_over_lanes && partitions_borders_)) return false;
  auto solution = solve_for(expanded, loop_.name, context_.ranges());
  if (!solution) return false;
  if (is_choice && is_warm_up(solution->interval, names)) {
    if (!partitions_borders_) return false;
    steady_.has_warm_up = true;
  }
  ++steady_.solved;
  steady_.range = intersection(steady_.range, solution->interval);
  if (solution->needed.defined()) {
    steady_.needed = steady_.needed.defined() ? binary(Kind::And, steady_.needed, solution->needed)
                                              : solution->needed;
  }
  steady_.has_thick_border |= is_over_unknown || is_about_tiles(names);
  count_saving(names, is_choice);
  return true;
}

void SteadyRewriter::count_saving(const std::unordered_set<std::string>& names, bool is_choice) {
  const bool over_lanes =
      std::ranges::any_of(lanes_, [&](const std::string& lane) { return names.count(lane) != 0; });
  if (inside_lanes_ || over_lanes) {
    ++steady_.saving.over_lanes;
    return;
  }
  if (enclosing_.empty() && has_inner_loops_) return;
  if (is_choice) {
    steady_.saving.always_pays = true;
  } else if (enclosing_.empty() || names.count(enclosing_.back())) {
    ++steady_.saving.operations;
  }
}

// Whether all iterations except the first are steady, independent of inner loops.
bool SteadyRewriter::is_warm_up(const Interval& steady,
                                const std::unordered_set<std::string>& names) const {
  const auto is_inside = [&](const std::string& name) {
    return name != loop_.name && (inner_extents_.count(name) || of_unknown_extent_.count(name));
  };
  return has_inner_loops_ && steady.min.defined() && !steady.max.defined() &&
         std::ranges::none_of(names, is_inside) && can_prove(steady.min <= loop_.min + 1);
}

bool SteadyRewriter::is_about_tiles(const std::unordered_set<std::string>& names) const {
  int64_t points = 1, longest = 0;
  for (const std::string& name : names) {
    auto it = inner_extents_.find(name);
    if (it == inner_extents_.end()) continue;
    points *= it->second;
    if (inner_serial_.count(name)) longest = std::max(longest, it->second);
  }
  return longest >= thick_loop && points >= thick_points;
}

}  // namespace retrograde::lower
