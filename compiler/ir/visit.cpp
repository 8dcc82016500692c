// Children, rewriting and substitution.
#include "ir/visit.h"

#include <atomic>

#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::ir {

namespace {

bool is_leaf(const Expr& e) { return e.kind() == Kind::Variable || e.kind() <= Kind::StringImm; }

// Visits the child expressions and statements among the fields of a node.
struct ChildVisit {
  ExprVisit on_expr;
  StmtVisit on_stmt;

  void operator()(const Expr& e) const {
    if (e.defined()) on_expr(e);
  }
  void operator()(const Stmt& s) const {
    if (s.defined()) on_stmt(s);
  }
  void operator()(const Range& r) const { (*this)(r.min), (*this)(r.extent); }
  void operator()(const StorageLayout& l) const { (*this)(l.folds), (*this)(l.first); }
  template <class T>
  void operator()(const std::vector<T>& fields) const {
    for (const T& field : fields) (*this)(field);
  }
  template <class T>
  void operator()(const T&) const {}

  template <class Handle>
  void of(const Handle& node) const {
    match(node, [&](const auto& n) {
      if constexpr (requires { n.fields(); })
        std::apply([&](const auto&... fields) { ((*this)(fields), ...); }, n.fields());
    });
  }
};

// Replaces children, and names if requested, and records whether any changed.
struct ChildMap {
  ExprMap map_expr;
  StmtMap map_stmt;
  const NameMap* names = nullptr;
  Kind kind = Kind::IntImm;  // of the current node
  std::string own_name = {};
  bool changed = false;

  Expr operator()(const Expr& e) { return replaced(e, map_expr); }
  Stmt operator()(const Stmt& s) { return replaced(s, map_stmt); }
  Range operator()(const Range& r) {
    Expr min = (*this)(r.min);
    return {min, (*this)(r.extent)};
  }
  StorageLayout operator()(const StorageLayout& l) {
    std::vector<Expr> folds = (*this)(l.folds);
    return {l.order, std::move(folds), l.place.empty() ? l.place : (*this)(l.place),
            (*this)(l.first), l.lead};
  }
  const std::string& operator()(const std::string& name) {
    if (!names) return name;
    own_name = (*names)(kind, name);
    changed |= own_name != name;
    return own_name;
  }
  template <class T>
  std::vector<T> operator()(const std::vector<T>& children) {
    return mapped(children, *this);
  }
  template <class T>
  const T& operator()(const T& other) {
    return other;
  }

  // Calls `make` with the fields after replacing children in evaluation order; returns `node` if
  // nothing changed.
  template <class Handle, class Make, class... Fields>
  Handle of(const Handle& node, const Make& make, const Fields&... fields) {
    kind = node.kind();
    std::tuple<decltype((*this)(fields))...> replaced{(*this)(fields)...};
    return changed ? Handle(std::apply(make, std::move(replaced))) : node;
  }

 private:
  template <class Handle, class Map>
  Handle replaced(const Handle& child, Map map) {
    if (!child.defined()) return child;
    Handle result = map(child);
    changed |= !result.same_as(child);
    return result;
  }
};

}  // namespace

void for_each_child(const Expr& e, ExprVisit on_expr) {
  const auto no_stmt = [](const Stmt&) {};
  ChildVisit{on_expr, no_stmt}.of(e);
}

void for_each_child(const Stmt& s, ExprVisit on_expr, StmtVisit on_stmt) {
  ChildVisit{on_expr, on_stmt}.of(s);
}

namespace {

Expr map_children(const Expr& e, ChildMap mapped) {
  const auto with_lanes_of = [](const ExprNode& n, const Expr& child) {
    return n.type.with_lanes(child.type().lanes());
  };
  return match(
      e,
      [&](const Cast& n) {
        const auto make = [&](const Expr& v) { return cast_to(with_lanes_of(n, v), v); };
        return mapped.of(e, make, n.value);
      },
      [&](const Reinterpret& n) {
        const auto make = [&](const Expr& v) { return reinterpret_as(with_lanes_of(n, v), v); };
        return mapped.of(e, make, n.value);
      },
      [&](const Binary& n) { return mapped.of(e, binary, n.kind, n.a, n.b); },
      [&](const Not& n) { return mapped.of(e, logical_not, n.a); },
      [&](const Select& n) {
        return mapped.of(e, make_select, n.condition, n.when_true, n.when_false);
      },
      [&](const Load& n) {
        const auto make = [&](const std::string& name, Expr index, Expr predicate) {
          return make_load(with_lanes_of(n, index), name, index, predicate, n.symbol);
        };
        return mapped.of(e, make, n.name, n.index, n.predicate);
      },
      [&](const Ramp& n) { return mapped.of(e, make_ramp, n.base, n.stride, n.lanes); },
      [&](const Broadcast& n) { return mapped.of(e, make_broadcast, n.value, n.lanes); },
      [&](const Call& n) {
        const auto make = [&](std::vector<Expr> args) {
          if (n.call_type == CallType::Operator) return call_op(n.op, n.type, std::move(args));
          return Expr(make_node<Call>(n.type, n.call_type, n.op, n.name, std::move(args),
                                      n.component, n.symbol));
        };
        return mapped.of(e, make, n.args);
      },
      [&](const Let& n) {
        const auto make = [&](auto name, Expr value, Expr body) {
          return make_let(name, value, body);
        };
        return mapped.of(e, make, n.name, n.value, n.body);
      },
      [&](const Shuffle& n) { return mapped.of(e, make_shuffle, n.vectors, n.indices); },
      [&](const VectorReduce& n) {
        return mapped.of(e, make_vector_reduce, n.op, n.value, n.type.lanes());
      },
      [&](const ExprNode&) { return e; });
}

Stmt map_children(const Stmt& s, ChildMap mapped) {
  return match(
      s,
      [&](const LetStmt& n) {
        const auto make = [&](auto name, Expr value, Stmt body) {
          return make_let(name, value, body);
        };
        return mapped.of(s, make, n.name, n.value, n.body);
      },
      [&](const Assert& n) { return mapped.of(s, make_assert, n.condition, n.error); },
      [&](const ProducerConsumer& n) {
        return mapped.of(s, make_producer_consumer, n.name, n.produces, n.body);
      },
      [&](const For& n) {
        return mapped.of(s, make_for, n.name, n.min, n.extent, n.runs, n.body, n.partition);
      },
      [&](const Store& n) {
        return mapped.of(s, make_store, n.name, n.value, n.index, n.predicate, n.symbol);
      },
      [&](const Provide& n) {
        return mapped.of(s, make_provide, n.name, n.values, n.args, n.predicate);
      },
      [&](const Realize& n) {
        const auto make = [](auto name, auto types, MemoryType memory, auto bounds, auto layout,
                             Stmt body) {
          return make_realize(name, std::move(types), memory, std::move(bounds), std::move(body),
                              std::move(layout));
        };
        return mapped.of(s, make, n.name, n.types, n.memory, n.bounds, n.layout, n.body);
      },
      [&](const Allocate& n) {
        const auto make = [](auto name, Type type, MemoryType memory, Expr elements, Expr offset,
                             Stmt body) {
          return make_allocate(name, type, memory, std::move(elements), std::move(body),
                               std::move(offset));
        };
        return mapped.of(s, make, n.name, n.type, n.memory, n.elements, n.offset, n.body);
      },
      [&](const Free& n) { return mapped.of(s, make_free, n.name); },
      [&](const Block& n) { return mapped.of(s, make_block, n.stmts); },
      [&](const IfThenElse& n) {
        return mapped.of(s, make_if, n.condition, n.when_true, n.when_false);
      },
      [&](const Evaluate& n) { return mapped.of(s, make_evaluate, n.value); },
      [&](const Atomic& n) { return mapped.of(s, make_atomic, n.name, n.body); },
      [&](const Fork& n) { return mapped.of(s, make_fork, n.first, n.rest); },
      [&](const Prefetch& n) {
        return mapped.of(s, make_prefetch, n.name, n.type, n.bounds, n.symbol);
      },
      [&](const Launch& n) {
        return mapped.of(s, make_launch, n.name, n.blocks, n.threads, n.shared_bytes, n.body);
      },
      [&](const StmtNode&) { return s; });
}

constexpr auto same_stmt = [](const Stmt& s) { return s; };

}  // namespace

Expr map_children(const Expr& e, ExprMap map) { return map_children(e, ChildMap{map, same_stmt}); }
Stmt map_children(const Stmt& s, ExprMap map, StmtMap map_stmt) {
  return map_children(s, ChildMap{map, map_stmt});
}
Stmt map_children(const Stmt& s, StmtMap map_stmt) {
  return map_children(
      s, [](const Expr& e) { return e; }, map_stmt);
}
Expr map_children(const Expr& e, ExprMap map, NameMap names) {
  return map_children(e, ChildMap{map, same_stmt, &names});
}
Stmt map_children(const Stmt& s, ExprMap map, StmtMap map_stmt, NameMap names) {
  return map_children(s, ChildMap{map, map_stmt, &names});
}

// ---- rewriting ----

Expr Rewriter::operator()(const Expr& e) {
  if (!e.defined()) return e;
  if (is_leaf(e)) return rewrite(e);
  return memo_.get(e, [&] { return rewrite(e); });
}

Expr Rewriter::children(const Expr& e) {
  return map_children(e, [this](const Expr& child) { return (*this)(child); });
}

Stmt Rewriter::children(const Stmt& s) {
  return map_children(
      s, [this](const Expr& child) { return (*this)(child); },
      [this](const Stmt& child) { return (*this)(child); });
}

Expr StepRewriter::rewrite(const Expr& e) {
  Expr result = step_(e, recurse_);
  return result.defined() ? result : children(e);
}

Expr rewrite(const Expr& e, RewriteStep step) { return StepRewriter(std::move(step))(e); }
Stmt rewrite(const Stmt& s, RewriteStep step) { return StepRewriter(std::move(step))(s); }

namespace {

template <class Tree>
Tree substituted(const Tree& tree, const Substitution& values) {
  if (values.empty()) return tree;
  return rewrite(tree, [&](const Expr& e, const auto&) {
    const auto* var = e.as<Variable>();
    return var ? value_or(values, var->name, {}) : Expr();
  });
}

}  // namespace

Expr substitute(const Expr& e, const Substitution& values) { return substituted(e, values); }
Stmt substitute(const Stmt& s, const Substitution& values) { return substituted(s, values); }
Expr substitute(const Expr& e, const std::string& name, const Expr& value) {
  return substitute(e, Substitution{{name, value}});
}
Stmt substitute(const Stmt& s, const std::string& name, const Expr& value) {
  return substitute(s, Substitution{{name, value}});
}

// ---- uses ----

bool uses_variable(const Expr& e, const std::string& name) {
  return any_node(e, [&](const Variable& var) { return var.name == name; });
}
bool uses_variable(const Stmt& s, const std::string& name) {
  return any_node(s, [&](const Variable& var) { return var.name == name; });
}
bool uses_any_variable(const Expr& e, const std::unordered_set<std::string>& names) {
  return any_node(e, [&](const Variable& var) { return names.contains(var.name); });
}
bool has_loops(const Stmt& s, ForType runs) {
  return any_node(s, [&](const For& loop) { return loop.runs == runs; });
}

std::string unique_name(const std::string& prefix) {
  static std::atomic<uint64_t> next{0};
  return prefix + "$" + std::to_string(next++);
}

}  // namespace retrograde::ir
