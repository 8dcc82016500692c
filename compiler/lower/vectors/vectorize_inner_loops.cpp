// vectorize_inner_loops -- vectorize innermost loops that have no scheduling directive.
// In:  FlatStorage, unrolled; names unique.
// Out: FlatStorage; the same elements with the same values; names unique.
//
//   for (x, a, n) {                   let vectors = max(n, 0) / 8
//     out[x] = in[x*2] + 1      =>    for (v, 0, vectors) {
//   }                                   vectorized for (x, a + v*8, 8) { out[x] = in[x*2] + 1 }
//                                     }
//                                     for (x.$1, a + vectors*8, n - vectors*8) { out[x.$1] = ... }
//
// Method: accepts a serial loop over a pure variable that contains only scalar stores and lets, if all its accesses
//         have a vector form. An index is described by a period p and a step s over the loop variable x:
//         index(x + p) = index(x) + s for all x. Sums of such indices, products with constants, and quotients
//         and remainders by constants have this form again. A load with a small step is dense, strided or interleaved
//         (interleave_vectors). Stores must be dense, or a store of step s needs s neighbours. The widest
//         value sets the number of lanes: it fills one register.
// Not done: reductions, whose order matters; gathers; conditions that vary; bodies of more than largest_body nodes,
//           for which a second copy costs more compile time than it is worth.
// Source: folklore. Tests: test/golden/lower/vectorize_inner_loops/, loop_passes_test.
#include "lower/vectors/vectorize_inner_loops.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int64_t max_load_step = 4, max_store_step = 8, max_period = 8;
constexpr size_t largest_body = 600;

// index(x + period) = index(x) + step.
struct Movement {
  int64_t period = 1, step = 0;
  bool stays() const { return period == 1 && step == 0; }
};
using MaybeMovement = std::optional<Movement>;

MaybeMovement sum_of(const Movement& a, const Movement& b, int64_t factor_of_b) {
  const int64_t period = std::lcm(a.period, b.period);
  if (period > max_period) return std::nullopt;
  return Movement{period,
                  a.step * (period / a.period) + factor_of_b * b.step * (period / b.period)};
}

bool is_small(int64_t n) { return std::abs(n) <= INT32_MAX; }

// Movements of integers of 32 bits and more, which are assumed not to overflow.
class Movements {
 public:
  explicit Movements(const std::string& variable) : variable_(variable) {}

  void bind(const std::string& name, const Expr& value) { lets_[name] = value; }
  const Expr* value_of(const std::string& name) const { return find_or_null(lets_, name); }

  // nullopt: the expression varies in another way.
  MaybeMovement of(const Expr& e) {
    return memo_.get(e, [&] { return find(e); });
  }

 private:
  MaybeMovement find(const Expr& e) {
    if (const auto* name = e.as<Variable>()) {
      const Expr* value = value_of(name->name);
      if (value) return of(*value);
      return name->name == variable_ ? Movement{1, 1} : Movement{};
    }
    const Type type = e.type();
    if (type.is_scalar() && type.is_int() && type.bits() >= 32) {
      if (e.kind() == Kind::Add) return of_sum(*e.as<Binary>(), 1);
      if (e.kind() == Kind::Sub) return of_sum(*e.as<Binary>(), -1);
      if (e.kind() == Kind::Mul) return of_product(*e.as<Binary>());
      if (e.kind() == Kind::Div || e.kind() == Kind::Mod)
        return of_quotient(e.kind(), *e.as<Binary>());
    }
    bool stays = true;
    for_each_child(e, [&](const Expr& child) {
      const MaybeMovement movement = of(child);
      stays = stays && movement && movement->stays();
    });
    return stays ? MaybeMovement(Movement{}) : std::nullopt;
  }

  MaybeMovement of_sum(const Binary& n, int64_t sign) {
    const MaybeMovement a = of(n.a), b = of(n.b);
    return a && b ? sum_of(*a, *b, sign) : std::nullopt;
  }

  MaybeMovement of_product(const Binary& n) {
    const MaybeMovement a = of(n.a), b = of(n.b);
    if (!a || !b) return std::nullopt;
    if (a->stays() && b->stays()) return Movement{};
    const auto factor = as_const_int(b->stays() ? n.b : n.a);
    const Movement& moved = b->stays() ? *a : *b;
    if (!factor || !is_small(*factor) || !is_small(moved.step)) return std::nullopt;
    return Movement{moved.period, moved.step * *factor};
  }

  MaybeMovement of_quotient(Kind kind, const Binary& n) {
    const MaybeMovement a = of(n.a), b = of(n.b);
    if (!a || !b || !b->stays()) return std::nullopt;
    if (a->stays()) return Movement{};
    const auto divisor = as_const_int(n.b);
    if (!divisor || *divisor <= 0 || a->period != 1) return std::nullopt;
    const int64_t period = *divisor / std::gcd(a->step, *divisor);
    if (period > max_period) return std::nullopt;
    return Movement{period, kind == Kind::Div ? a->step * period / *divisor : 0};
  }

  const std::string variable_;
  std::unordered_map<std::string, Expr> lets_;  // bound in the body
  NodeMemo<MaybeMovement> memo_;
};

// Decides whether vectorizing a loop body pays, and with how many lanes.
class BodyCheck {
 public:
  explicit BodyCheck(const For& loop) : movements_(loop.name) {
    has_form_ = visit(loop.body) && seen_.size() <= largest_body && stores_fill_rows();
  }

  // 0: do not vectorize.
  int lanes(int vector_bytes) const {
    return has_form_ && has_stores() ? vector_bytes / widest_bytes_ : 0;
  }

 private:
  struct Stores {
    int64_t step = 0, count = 0;
    bool are_alike = true;
  };

  bool has_stores() const { return !stores_.empty(); }

  bool visit(const Stmt& s) {
    if (const auto* block = s.as<Block>())
      return std::ranges::all_of(block->stmts, [&](const Stmt& part) { return visit(part); });
    if (const auto* let = s.as<LetStmt>()) {
      movements_.bind(let->name, let->value);
      return has_vector_form(let->value) && visit(let->body);
    }
    const auto* store = s.as<Store>();
    return store && visit_store(*store);
  }

  bool visit_store(const Store& n) {
    const MaybeMovement index = movements_.of(n.index);
    if (n.predicate.defined() || !index || index->period != 1 || index->step == 0) return false;
    Stores& stores = stores_[n.name];
    stores.are_alike = stores.count == 0 || stores.step == index->step;
    stores.step = index->step;
    ++stores.count;
    return stores.are_alike && has_vector_form(n.index) && has_vector_form(n.value) &&
           measure(n.value);
  }

  // A store with step s must have s - 1 neighbours, so that together they become one dense store.
  bool stores_fill_rows() const {
    return std::all_of(stores_.begin(), stores_.end(), [](const auto& entry) {
      const int64_t step = entry.second.step;
      return std::abs(step) == 1 ||
             (step > 1 && step <= max_store_step && entry.second.count >= step);
    });
  }

  bool has_vector_form(const Expr& e) {
    if (!seen_.insert(e.get()).second) return true;
    if (!e.type().is_scalar() || !is_kind_with_lanes(e)) return false;
    if (const auto* let = e.as<Let>()) movements_.bind(let->name, let->value);
    bool all = true;
    for_each_child(e, [&](const Expr& child) { all = all && has_vector_form(child); });
    return all;
  }

  bool is_kind_with_lanes(const Expr& e) {
    if (e.type().is_float() && e.type().bits() == 16) return false;
    if (const auto* load = e.as<Load>()) return is_load_with_lanes(*load);
    if (const auto* call = e.as<Call>()) {
      if (call->call_type != CallType::Operator) return false;
      const OpClass cls = op_info(call->op).cls;
      return cls == OpClass::Pure || cls == OpClass::Marker;
    }
    const bool divides = e.kind() == Kind::Div || e.kind() == Kind::Mod;
    if (divides && !e.type().is_float()) return is_const(e.as<Binary>()->b) || stays(e);
    return true;
  }

  bool stays(const Expr& e) {
    const MaybeMovement movement = movements_.of(e);
    return movement && movement->stays();
  }

  bool is_load_with_lanes(const Load& n) {
    const MaybeMovement index = movements_.of(n.index);
    return !n.predicate.defined() && index && std::abs(index->step) <= max_load_step;
  }

  // Finds the widest value, indices left out.
  bool measure(const Expr& e) {
    if (!measured_.insert(e.get()).second) return true;
    widest_bytes_ = std::max(widest_bytes_, e.type().bytes());
    if (const auto* name = e.as<Variable>()) {
      if (const Expr* value = movements_.value_of(name->name)) measure(*value);
    }
    if (!e.as<Load>()) for_each_child(e, [&](const Expr& child) { measure(child); });
    return true;
  }

  Movements movements_;
  std::map<std::string, Stores> stores_;
  std::unordered_set<const ExprNode*> seen_, measured_;
  int widest_bytes_ = 1;
  bool has_form_ = false;
};

Stmt in_vectors(const For& loop, int lanes, FreshNames& fresh) {
  const Type type = loop.min.type();
  const auto constant = [&](int64_t n) { return make_const(type, n); };
  const Expr count =
      simplify(binary(Kind::Div, max(loop.extent, make_zero(type)), constant(lanes)));
  const std::string counter = fresh(loop.name), count_name = fresh(loop.name + ".vectors");
  const Expr vectors = is_const(count) ? count : variable(count_name, type);
  const auto lanes_of = [&](const Expr& n) { return binary(Kind::Mul, n, constant(lanes)); };
  const Expr first = binary(Kind::Add, loop.min, lanes_of(variable(counter, type)));
  const Stmt vector = make_for(loop.name, first, constant(lanes), ForType::Vectorized, loop.body);
  const Stmt whole = make_for(counter, make_zero(type), vectors, ForType::Serial, vector);
  const Expr done = lanes_of(vectors), left = simplify(binary(Kind::Sub, loop.extent, done));
  const Stmt tail = make_for(loop.name, simplify(binary(Kind::Add, loop.min, done)), left,
                             ForType::Serial, loop.body);
  const Stmt both = is_zero(left) ? whole : make_block({whole, copy_statement(tail, fresh)});
  return is_const(count) ? both : make_let(count_name, count, both);
}

}  // namespace

Stmt vectorize_inner_loops(const Stmt& all, const InnerLoops& loops) {
  if (!all.defined()) return all;
  FreshNames fresh(all);
  return rewrite_statements(all, [&](const Stmt& s, auto& rewriter) {
    const auto* loop = s.as<For>();
    if (loop && loop->runs == ForType::Vectorized) return s;
    if (!loop || loop->runs != ForType::Serial || !loops.is_independent(*loop))
      return rewriter.children(s);
    const int lanes = BodyCheck(*loop).lanes(loops.vector_bytes);
    const auto extent = as_const_int(loop->extent);
    const bool pays = lanes > 1 && (!extent || *extent >= lanes);
    return pays ? in_vectors(*loop, lanes, fresh) : rewriter.children(s);
  });
}

}  // namespace retrograde::lower
