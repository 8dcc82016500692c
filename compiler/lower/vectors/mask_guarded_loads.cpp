// mask_guarded_loads -- what a select leaves out need not be read from a place that it may be read from.
// In:  Vector; names unique.
// Out: Vector; names unique; the same stores; fewer elements are read.
//
//   select(x < 0 || n - 1 < x, 0, in[max(min(x, n - 1), 0)])   =>   select(x < 0 || n - 1 < x, 0,
//                                                                          in[x if !(x < 0 || n - 1 < x)])
//
// where x are neighbours, ramp(b, 1, lanes). Boundary conditions look like this in the borders that partition_loops
// leaves; clamped, the places would be a gather, where now they are one load under a mask.
//
// Method: in the arm that is taken where a condition does not hold, none of its alternatives holds: of a comparison of
//         two vectors, a min or max of the same two is one of them. A load whose place is dense then gets the mask.
// Not done: elements of less than 32 bits, whose masks most machines do lane by lane; places that stay clamped, as
//           those of repeated edges.
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

// Where the vectors a and b of integers are known to be in this order: a <= b.
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

// What an arm reads where a condition does not hold.
class ArmRewriter : public Rewriter {
 public:
  ArmRewriter(const Expr& condition, const std::vector<Order>& orders)
      : condition_(condition), orders_(orders) {}

 protected:
  Expr rewrite(const Expr& e) override {
    const auto* load = e.as<Load>();
    if (!load)
      return e.kind() == Kind::Let ? e : children(e);  // what is named may not be in the condition
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
