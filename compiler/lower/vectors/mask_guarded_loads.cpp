// mask_guarded_loads -- replace clamped gathers under a select by dense loads under the select's mask.
// In:  Vector; names unique.
// Out: Vector; names unique; the same stores; fewer elements are read.
//
//   select(x < 0 || n - 1 < x, 0, in[max(min(x, n - 1), 0)])   =>   select(x < 0 || n - 1 < x, 0,
//                                                                          in[x if !(x < 0 || n - 1 < x)])
//
// where x are consecutive, ramp(b, 1, lanes). Boundary conditions look like this in the borders that partition_loops
// leaves. The clamped index is a gather; without the clamp it is one masked load.
//
// Method: in the arm that is taken where a condition is false, all of its alternatives are false. A false comparison
//         of two vectors decides which of the two their min or max is. A load whose index is dense after this
//         simplification gets the mask.
// Not done: elements of less than 32 bits, whose masked loads most processors run lane by lane; indices that stay
//           clamped, as with repeat_edge.
// Source: folklore. Tests: test/golden/lower/mask_guarded_loads/, loop_passes_test.
#include <algorithm>
#include <vector>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "lower/statement_passes.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int least_bits = 32;

// A known order of two integer vectors: a <= b.
struct Order {
  Expr a, b;
};

void add_orders_where_false(const Expr& condition, std::vector<Order>& orders) {
  const auto* n = condition.as<Binary>();
  if (!n) return;
  if (n->kind == Kind::Or) {
    add_orders_where_false(n->a, orders);
    add_orders_where_false(n->b, orders);
  } else if (n->a.type().is_int() && n->a.type().is_vector()) {
    if (n->kind == Kind::LT || n->kind == Kind::LE) orders.push_back({n->b, n->a});
    if (n->kind == Kind::GT || n->kind == Kind::GE) orders.push_back({n->a, n->b});
  }
}

class ClampDropper : public Rewriter {
 public:
  explicit ClampDropper(const std::vector<Order>& orders) : orders_(orders) {}

 protected:
  Expr rewrite(const Expr& e) override {
    const Expr copy = children(e);
    const auto* n = copy.as<Binary>();
    if (!n || (n->kind != Kind::Min && n->kind != Kind::Max)) return copy;
    for (const Order& order : orders_) {
      const bool is_straight = equal(order.a, n->a) && equal(order.b, n->b);
      const bool is_reverse = equal(order.a, n->b) && equal(order.b, n->a);
      if (is_straight || is_reverse) return n->kind == Kind::Min ? order.a : order.b;
    }
    return copy;
  }

 private:
  const std::vector<Order>& orders_;
};

// Rewrites the loads in the arm that a select takes where its condition is false.
class ArmRewriter : public Rewriter {
 public:
  ArmRewriter(const Expr& condition, const std::vector<Order>& orders)
      : condition_(condition), orders_(orders) {}

 protected:
  Expr rewrite(const Expr& e) override {
    const auto* load = e.as<Load>();
    if (!load)
      return e.kind() == Kind::Let
                 ? e
                 : children(e);  // the condition may not see names that a let binds
    const Type type = load->type;
    const bool is_gather = type.is_vector() && !load->index.as<Ramp>();
    if (!is_gather || type.bits() < least_bits ||
        load->index.type().lanes() != condition_.type().lanes())
      return e;
    const Expr index = ClampDropper(orders_)(load->index);
    if (index.same_as(load->index)) return e;
    const Expr place = simplify(index);
    const auto* ramp = place.as<Ramp>();
    if (!ramp || !ramp->base.type().is_scalar() || !is_const_int(ramp->stride, 1)) return e;
    const Expr holds = simplify(logical_not(condition_));
    return make_load(type, load->name, place,
                     load->predicate.defined() ? load->predicate && holds : holds, load->symbol);
  }

 private:
  const Expr condition_;
  const std::vector<Order>& orders_;
};

class SelectRewriter : public Rewriter {
 protected:
  Expr rewrite(const Expr& e) override {
    const Expr copy = children(e);
    const auto* n = copy.as<Select>();
    if (!n || !n->condition.type().is_vector()) return copy;
    std::vector<Order> orders;
    add_orders_where_false(n->condition, orders);
    if (orders.empty()) return copy;
    const Expr arm = ArmRewriter(n->condition, orders)(n->when_false);
    return arm.same_as(n->when_false) ? copy : make_select(n->condition, n->when_true, arm);
  }
};

}  // namespace

Stmt mask_guarded_loads(const Stmt& s) { return SelectRewriter()(s); }

}  // namespace retrograde::lower
