#include "lower/walk_in_bounds.h"

#include "ir/build.h"

namespace retrograde::lower {

namespace {

class BoundsWalk {
 public:
  BoundsWalk(FunctionRef<void(const Expr&, const Scope<Interval>&)> on_expr,
             FunctionRef<void(const Stmt&, const Scope<Interval>&)> on_stmt)
      : on_expr_(on_expr), on_stmt_(on_stmt) {}

  void visit(const Stmt& s) {
    on_stmt_(s, scope_);
    if (const auto* n = s.as<For>()) return parts(s, n->name, range_of(*n));
    if (const auto* n = s.as<LetStmt>()) {
      const bool is_index = n->value.type() == Int(32);
      return parts(s, n->name, is_index ? bounds_of(n->value, scope_) : Interval::everything());
    }
    for_each_child(
        s, [&](const Expr& e) { on_expr_(e, scope_); }, [&](const Stmt& part) { visit(part); });
  }

 private:
  FunctionRef<void(const Expr&, const Scope<Interval>&)> on_expr_;
  FunctionRef<void(const Stmt&, const Scope<Interval>&)> on_stmt_;
  Scope<Interval> scope_;

  Interval range_of(const For& n) const {
    return {bounds_of(n.min, scope_).min, bounds_of(n.min + n.extent - 1, scope_).max};
  }

  void parts(const Stmt& s, const std::string& name, const Interval& range) {
    const auto inside = [&](const Stmt& body) {
      scope_.push(name, range);
      visit(body);
      scope_.pop(name);
    };
    for_each_child(
        s, [&](const Expr& e) { on_expr_(e, scope_); }, inside);
  }
};

}  // namespace

void walk_in_bounds(const Stmt& s, FunctionRef<void(const Expr&, const Scope<Interval>&)> on_expr,
                    FunctionRef<void(const Stmt&, const Scope<Interval>&)> on_stmt) {
  if (s.defined()) BoundsWalk(on_expr, on_stmt).visit(s);
}

}  // namespace retrograde::lower
