// Children, walks, rewriting and substitution.
#include "ir/visit.h"

#include <algorithm>
#include <atomic>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/node_set.h"

namespace retrograde::ir {

namespace {

bool is_leaf(const Expr& e) { return e.kind() == Kind::Variable || e.kind() <= Kind::StringImm; }

// Maps a list; says whether anything changed.
std::vector<Expr> map_all(const std::vector<Expr>& es, ExprMap map, bool& changed) {
  std::vector<Expr> result;
  result.reserve(es.size());
  for (const Expr& e : es) {
    result.push_back(map(e));
    changed |= !result.back().same_as(e);
  }
  return result;
}

Expr map_optional(const Expr& e, ExprMap map) { return e.defined() ? map(e) : e; }
Stmt map_optional(const Stmt& s, StmtMap map) { return s.defined() ? map(s) : s; }

}  // namespace

void for_each_child(const Expr& e, ExprVisit on) {
  const auto all = [&](const std::vector<Expr>& es) {
    for (const Expr& child : es) on(child);
  };
  match(
      e, [&](const Cast& n) { on(n.value); }, [&](const Reinterpret& n) { on(n.value); },
      [&](const Binary& n) { on(n.a), on(n.b); }, [&](const Not& n) { on(n.a); },
      [&](const Select& n) { on(n.condition), on(n.when_true), on(n.when_false); },
      [&](const Load& n) {
        on(n.index);
        if (n.predicate.defined()) on(n.predicate);
      },
      [&](const Ramp& n) { on(n.base), on(n.stride); }, [&](const Broadcast& n) { on(n.value); },
      [&](const Call& n) { all(n.args); }, [&](const Let& n) { on(n.value), on(n.body); },
      [&](const Shuffle& n) { all(n.vectors); }, [&](const VectorReduce& n) { on(n.value); },
      [](const ExprNode&) {});
}

void for_each_child(const Stmt& s, ExprVisit on, StmtVisit on_stmt) {
  const auto all = [&](const std::vector<Expr>& es) {
    for (const Expr& child : es) on(child);
  };
  const auto maybe = [&](const Expr& e) {
    if (e.defined()) on(e);
  };
  const auto maybe_stmt = [&](const Stmt& child) {
    if (child.defined()) on_stmt(child);
  };
  match(
      s, [&](const LetStmt& n) { on(n.value), maybe_stmt(n.body); },
      [&](const Assert& n) { on(n.condition), on(n.error); },
      [&](const ProducerConsumer& n) { maybe_stmt(n.body); },
      [&](const For& n) { on(n.min), on(n.extent), maybe_stmt(n.body); },
      [&](const Store& n) { on(n.value), on(n.index), maybe(n.predicate); },
      [&](const Provide& n) { all(n.values), all(n.args), maybe(n.predicate); },
      [&](const Realize& n) {
        for (const Range& r : n.bounds) on(r.min), on(r.extent);
        maybe_stmt(n.body);
      },
      [&](const Allocate& n) { on(n.elements), maybe_stmt(n.body); },
      [&](const Block& n) {
        for (const Stmt& child : n.stmts) maybe_stmt(child);
      },
      [&](const Atomic& n) { maybe_stmt(n.body); },
      [&](const Fork& n) { maybe_stmt(n.first), maybe_stmt(n.rest); },
      [&](const Prefetch& n) {
        for (const Range& r : n.bounds) on(r.min), on(r.extent);
      },
      [&](const IfThenElse& n) {
        on(n.condition), maybe_stmt(n.when_true), maybe_stmt(n.when_false);
      },
      [&](const Evaluate& n) { on(n.value); }, [](const StmtNode&) {});
}

Expr map_children(const Expr& e, ExprMap map) {
  return match(
      e,
      [&](const Cast& n) {
        Expr value = map(n.value);
        return value.same_as(n.value) ? e : cast_to(n.type.with_lanes(value.type().lanes()), value);
      },
      [&](const Reinterpret& n) {
        Expr value = map(n.value);
        return value.same_as(n.value)
                   ? e
                   : reinterpret_as(n.type.with_lanes(value.type().lanes()), value);
      },
      [&](const Binary& n) {
        Expr a = map(n.a), b = map(n.b);
        return a.same_as(n.a) && b.same_as(n.b) ? e : binary(n.kind, std::move(a), std::move(b));
      },
      [&](const Not& n) {
        Expr a = map(n.a);
        return a.same_as(n.a) ? e : logical_not(std::move(a));
      },
      [&](const Select& n) {
        Expr c = map(n.condition), t = map(n.when_true), f = map(n.when_false);
        if (c.same_as(n.condition) && t.same_as(n.when_true) && f.same_as(n.when_false)) return e;
        return make_select(std::move(c), std::move(t), std::move(f));
      },
      [&](const Load& n) {
        Expr index = map(n.index), predicate = map_optional(n.predicate, map);
        if (index.same_as(n.index) && predicate.same_as(n.predicate)) return e;
        const Type type = n.type.with_lanes(index.type().lanes());
        return make_load(type, n.name, std::move(index), std::move(predicate), n.symbol);
      },
      [&](const Ramp& n) {
        Expr base = map(n.base), stride = map(n.stride);
        if (base.same_as(n.base) && stride.same_as(n.stride)) return e;
        return make_ramp(std::move(base), std::move(stride), n.lanes);
      },
      [&](const Broadcast& n) {
        Expr value = map(n.value);
        return value.same_as(n.value) ? e : make_broadcast(std::move(value), n.lanes);
      },
      [&](const Call& n) {
        bool changed = false;
        std::vector<Expr> args = map_all(n.args, map, changed);
        if (!changed) return e;
        if (n.call_type == CallType::Operator) return call_op(n.op, n.type, std::move(args));
        return Expr(
            new Call(n.type, n.call_type, n.op, n.name, std::move(args), n.component, n.symbol));
      },
      [&](const Let& n) {
        Expr value = map(n.value), body = map(n.body);
        if (value.same_as(n.value) && body.same_as(n.body)) return e;
        return make_let(n.name, std::move(value), std::move(body));
      },
      [&](const Shuffle& n) {
        bool changed = false;
        std::vector<Expr> vectors = map_all(n.vectors, map, changed);
        return changed ? make_shuffle(std::move(vectors), n.indices) : e;
      },
      [&](const VectorReduce& n) {
        Expr value = map(n.value);
        return value.same_as(n.value) ? e
                                      : make_vector_reduce(n.op, std::move(value), n.type.lanes());
      },
      [&](const ExprNode&) { return e; });
}

namespace {

std::vector<Range> map_ranges(const std::vector<Range>& ranges, ExprMap map, bool& changed) {
  std::vector<Range> result;
  for (const Range& r : ranges) {
    result.push_back({map(r.min), map(r.extent)});
    changed |= !result.back().min.same_as(r.min) || !result.back().extent.same_as(r.extent);
  }
  return result;
}

Stmt map_realize(const Stmt& s, const Realize& n, ExprMap map, StmtMap map_stmt) {
  bool changed = false;
  std::vector<Range> bounds = map_ranges(n.bounds, map, changed);
  Stmt body = map_optional(n.body, map_stmt);
  if (!changed && body.same_as(n.body)) return s;
  return make_realize(n.name, n.types, n.memory, std::move(bounds), std::move(body));
}

Stmt map_provide(const Stmt& s, const Provide& n, ExprMap map) {
  bool changed = false;
  std::vector<Expr> values = map_all(n.values, map, changed), args = map_all(n.args, map, changed);
  Expr predicate = map_optional(n.predicate, map);
  if (!changed && predicate.same_as(n.predicate)) return s;
  return make_provide(n.name, std::move(values), std::move(args), std::move(predicate));
}

Stmt map_block(const Stmt& s, const Block& n, StmtMap map_stmt) {
  bool changed = false;
  std::vector<Stmt> stmts;
  stmts.reserve(n.stmts.size());
  for (const Stmt& child : n.stmts) {
    stmts.push_back(map_optional(child, map_stmt));
    changed |= !stmts.back().same_as(child);
  }
  return changed ? make_block(std::move(stmts)) : s;
}

}  // namespace

Stmt map_children(const Stmt& s, ExprMap map, StmtMap map_stmt) {
  return match(
      s,
      [&](const LetStmt& n) {
        Expr value = map(n.value);
        Stmt body = map_optional(n.body, map_stmt);
        if (value.same_as(n.value) && body.same_as(n.body)) return s;
        return make_let(n.name, std::move(value), std::move(body));
      },
      [&](const Assert& n) {
        Expr condition = map(n.condition), error = map(n.error);
        if (condition.same_as(n.condition) && error.same_as(n.error)) return s;
        return make_assert(std::move(condition), std::move(error));
      },
      [&](const ProducerConsumer& n) {
        Stmt body = map_optional(n.body, map_stmt);
        return body.same_as(n.body) ? s
                                    : make_producer_consumer(n.name, n.produces, std::move(body));
      },
      [&](const For& n) {
        Expr min = map(n.min), extent = map(n.extent);
        Stmt body = map_optional(n.body, map_stmt);
        if (min.same_as(n.min) && extent.same_as(n.extent) && body.same_as(n.body)) return s;
        return make_for(n.name, std::move(min), std::move(extent), n.runs, std::move(body),
                        n.partition);
      },
      [&](const Store& n) {
        Expr value = map(n.value), index = map(n.index), predicate = map_optional(n.predicate, map);
        if (value.same_as(n.value) && index.same_as(n.index) && predicate.same_as(n.predicate))
          return s;
        return make_store(n.name, std::move(value), std::move(index), std::move(predicate),
                          n.symbol);
      },
      [&](const Provide& n) { return map_provide(s, n, map); },
      [&](const Realize& n) { return map_realize(s, n, map, map_stmt); },
      [&](const Allocate& n) {
        Expr elements = map(n.elements);
        Stmt body = map_optional(n.body, map_stmt);
        if (elements.same_as(n.elements) && body.same_as(n.body)) return s;
        return make_allocate(n.name, n.type, n.memory, std::move(elements), std::move(body));
      },
      [&](const Block& n) { return map_block(s, n, map_stmt); },
      [&](const IfThenElse& n) {
        Expr condition = map(n.condition);
        Stmt when_true = map_optional(n.when_true, map_stmt),
             when_false = map_optional(n.when_false, map_stmt);
        if (condition.same_as(n.condition) && when_true.same_as(n.when_true) &&
            when_false.same_as(n.when_false)) {
          return s;
        }
        return make_if(std::move(condition), std::move(when_true), std::move(when_false));
      },
      [&](const Evaluate& n) {
        Expr value = map(n.value);
        return value.same_as(n.value) ? s : make_evaluate(std::move(value));
      },
      [&](const Atomic& n) {
        Stmt body = map_optional(n.body, map_stmt);
        return body.same_as(n.body) ? s : make_atomic(n.name, std::move(body));
      },
      [&](const Fork& n) {
        Stmt first = map_optional(n.first, map_stmt), rest = map_optional(n.rest, map_stmt);
        if (first.same_as(n.first) && rest.same_as(n.rest)) return s;
        return make_fork(std::move(first), std::move(rest));
      },
      [&](const Prefetch& n) {
        bool changed = false;
        std::vector<Range> bounds = map_ranges(n.bounds, map, changed);
        return !changed ? s : make_prefetch(n.name, n.type, std::move(bounds), n.symbol);
      },
      [&](const StmtNode&) { return s; });
}

// ---- walks: an explicit stack, so that their depth is not bounded by the C++ stack ----

namespace {

class Walker {
 public:
  Walker(FunctionRef<bool(const Expr&)> enter_expr, FunctionRef<bool(const Stmt&)> enter_stmt)
      : enter_expr_(enter_expr), enter_stmt_(enter_stmt) {}
  void run(const Expr& e) {
    push(e);
    drain();
  }
  void run(const Stmt& s) {
    push(s);
    drain();
  }

 private:
  // Handles, not pointers: a lambda may drop the root. Only one of the two is defined.
  struct Item {
    Expr expr;
    Stmt stmt;
  };
  void push(const Expr& e) {
    if (e.defined()) stack_.push_back({e, {}});
  }
  void push(const Stmt& s) {
    if (s.defined()) stack_.push_back({{}, s});
  }
  void drain() {
    while (!stack_.empty()) {
      const Item item = std::move(stack_.back());
      stack_.pop_back();
      const size_t first = stack_.size();
      if (item.expr.defined()) {
        if (!visited_.insert(item.expr.get()) || !enter_expr_(item.expr)) continue;
        for_each_child(item.expr, [&](const Expr& child) { push(child); });
      } else {
        if (!visited_.insert(item.stmt.get()) || !enter_stmt_(item.stmt)) continue;
        for_each_child(
            item.stmt, [&](const Expr& child) { push(child); },
            [&](const Stmt& child) { push(child); });
      }
      std::reverse(stack_.begin() + first, stack_.end());
    }
  }

  FunctionRef<bool(const Expr&)> enter_expr_;
  FunctionRef<bool(const Stmt&)> enter_stmt_;
  std::vector<Item> stack_;
  NodeSet visited_;
};

}  // namespace

void walk(const Expr& e, FunctionRef<bool(const Expr&)> enter) {
  const auto no_stmts = [](const Stmt&) { return false; };
  Walker(enter, no_stmts).run(e);
}

void walk(const Stmt& s, FunctionRef<bool(const Expr&)> enter_expr,
          FunctionRef<bool(const Stmt&)> enter_stmt) {
  Walker(enter_expr, enter_stmt).run(s);
}

bool any_node(const Expr& e, FunctionRef<bool(const Expr&)> holds) {
  bool found = false;
  if (e.defined()) walk(e, [&](const Expr& node) { return !(found = found || holds(node)); });
  return found;
}

bool any_node(const Stmt& s, FunctionRef<bool(const Expr&)> expr_holds,
              FunctionRef<bool(const Stmt&)> stmt_holds) {
  bool found = false;
  if (!s.defined()) return false;
  walk(
      s, [&](const Expr& node) { return !(found = found || expr_holds(node)); },
      [&](const Stmt& node) { return !(found = found || stmt_holds(node)); });
  return found;
}

bool any_stmt(const Stmt& s, FunctionRef<bool(const Stmt&)> holds) {
  bool found = false;
  const auto no_exprs = [](const Expr&) { return false; };
  if (s.defined())
    walk(s, no_exprs, [&](const Stmt& node) { return !(found = found || holds(node)); });
  return found;
}

// ---- rewriting ----

Expr Rewriter::operator()(const Expr& e) {
  if (!e.defined()) return e;
  if (is_leaf(e)) return rewrite(e);
  if (const auto found = memo_.find(e.get()); found != memo_.end()) return found->second.value;
  Expr result = rewrite(e);
  memo_.emplace(e.get(), Entry{e, result});
  return result;
}

Expr Rewriter::children(const Expr& e) {
  return map_children(e, [this](const Expr& child) { return (*this)(child); });
}

Stmt Rewriter::children(const Stmt& s) {
  return map_children(
      s, [this](const Expr& child) { return (*this)(child); },
      [this](const Stmt& child) { return (*this)(child); });
}

namespace {

class StepRewriter : public Rewriter {
 public:
  explicit StepRewriter(const RewriteStep& step) : step_(step) {}

 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override { return step_(e, recurse_); }

 private:
  const RewriteStep& step_;
  // Rewrites its argument, a child of the node at hand.
  const std::function<Expr(const Expr&)> recurse_ = [this](const Expr& e) { return (*this)(e); };
};

class Substituter : public Rewriter {
 public:
  explicit Substituter(const Substitution& values) : values_(values) {}

 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    const auto* var = e.as<Variable>();
    if (!var) return children(e);
    const auto found = values_.find(var->name);
    return found == values_.end() ? e : found->second;
  }

 private:
  const Substitution& values_;
};

}  // namespace

Expr rewrite(const Expr& e, const RewriteStep& step) { return StepRewriter(step)(e); }

Expr substitute(const Expr& e, const Substitution& values) {
  return values.empty() ? e : Substituter(values)(e);
}
Stmt substitute(const Stmt& s, const Substitution& values) {
  return values.empty() ? s : Substituter(values)(s);
}
Expr substitute(const Expr& e, const std::string& name, const Expr& value) {
  return substitute(e, Substitution{{name, value}});
}
Stmt substitute(const Stmt& s, const std::string& name, const Expr& value) {
  return substitute(s, Substitution{{name, value}});
}

// ---- uses ----

bool uses_variable(const Expr& e, const std::string& name) {
  return any_node(e, [&](const Expr& node) {
    const auto* var = node.as<Variable>();
    return var && var->name == name;
  });
}
bool uses_variable(const Stmt& s, const std::string& name) {
  const auto is_use = [&](const Expr& node) {
    const auto* var = node.as<Variable>();
    return var && var->name == name;
  };
  return any_node(s, is_use, [](const Stmt&) { return false; });
}
bool uses_any_variable(const Expr& e, const std::unordered_set<std::string>& names) {
  return any_node(e, [&](const Expr& node) {
    const auto* var = node.as<Variable>();
    return var && names.contains(var->name);
  });
}

std::string unique_name(const std::string& prefix) {
  static std::atomic<uint64_t> next{0};
  return prefix + "$" + std::to_string(next++);
}

}  // namespace retrograde::ir
