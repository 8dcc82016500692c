// try_plain_products -- sum strong products with plain multiplications first, and repeat the sum if it gives NaN.
// In:  Vector; names unique.
// Out: Vector; names unique; the same values, except for the sign of a zero.
//
//   allocate kept[32] {                       allocate kept[32] {
//     kept[0..16] = f[..]                       kept[0..16] = f[..]
//     for (r, 0, n) {                           for (r, 0, n) {
//       kept[0..16] = kept[0..16]                 kept[0..16] = kept[0..16] + a[..] * b[r]
//           + strong_mul(a[..], b[r])           }
//     }                                    =>   if (any lane of kept[0..16] is NaN) {
//     f[..] = kept[0..16]                         kept[0..16] = f[..]
//   }                                             for (r, 0, n) { ... strong_mul ... }
//                                               }
//                                               f[..] = kept[0..16]
//                                             }
//
// Why: a strong product (0 * anything is 0) differs from a plain one only where 0 meets an infinity or NaN. The plain
//      product is then NaN, and so is every sum that contains it. A sum that is not NaN therefore equals the sum of
//      strong products. Strong products cost a comparison each, on the unit that adds, and nearly all programs
//      compute gradients of finite numbers.
//
// Method: matches storage that statements fill without reading it, loops that only add to the filled elements, and any
//         code that follows. The fill can be repeated. The check sums all elements, which may overflow to NaN although
//         none of them is NaN; the repeated sum then gives the same result.
// Not done: sums in storage that is not filled right before; masked fills.
// Source: our own; speculation followed by a check of the result, as in Rauchwerger and Padua, "The LRPD
//         test" (PLDI 1995). Tests: test/golden/lower/try_plain_products/, strong_zeros_test.
#include <algorithm>
#include <vector>

#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_passes.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

// Whether e is a strong product or a sum that contains one, such as the adjoint of an image that two Funcs read.
bool sums_strong_products(const Expr& e) {
  if (as_op(e, Op::strong_mul)) return true;
  const auto* sum = e.as<Binary>();
  const bool is_sum = sum && (sum->kind == Kind::Add || sum->kind == Kind::Sub);
  return is_sum && (sums_strong_products(sum->a) || sums_strong_products(sum->b));
}

// The sum e with plain products instead of strong ones.
Expr with_plain_products(const Expr& e) {
  if (const Call* product = as_op(e, Op::strong_mul)) return product->args[0] * product->args[1];
  const auto* sum = e.as<Binary>();
  if (!sum || (sum->kind != Kind::Add && sum->kind != Kind::Sub)) return e;
  const Expr a = with_plain_products(sum->a), b = with_plain_products(sum->b);
  return sum->kind == Kind::Add ? a + b : a - b;
}

// Matches statements that only add to elements of one array, all of which were filled before.
class SumsInto {
 public:
  SumsInto(const std::string& array, const std::vector<const Store*>& filled)
      : array_(array), filled_(filled) {}

  bool holds(const Stmt& s) {
    return match(
        s,
        [&](const For& n) {
          has_loops = true;
          return n.runs == ForType::Serial && does_not_read(n.min) && does_not_read(n.extent) &&
                 holds(n.body);
        },
        [&](const LetStmt& n) { return does_not_read(n.value) && holds(n.body); },
        [&](const IfThenElse& n) {
          return does_not_read(n.condition) && holds(n.when_true) &&
                 (!n.when_false.defined() || holds(n.when_false));
        },
        [&](const Block& n) {
          return std::all_of(n.stmts.begin(), n.stmts.end(),
                             [&](const Stmt& part) { return holds(part); });
        },
        [&](const Store& n) { return adds(n); }, [](const StmtNode&) { return false; });
  }

  bool has_loops = false, has_strong_products = false;

 private:
  bool does_not_read(const Expr& e) const { return !loads_from(e, array_); }

  bool adds(const Store& store) {
    if (store.name != array_ || !store.value.type().is_float() || store.value.type().bits() < 32)
      return false;
    const auto chain = find_update_chain(store);
    if (!chain || chain->kind != Kind::Add) return false;
    for (const UpdateChain::Term& term : chain->terms)
      has_strong_products |= sums_strong_products(term.value);
    return std::any_of(filled_.begin(), filled_.end(),
                       [&](const Store* fill) { return equal(fill->index, store.index); });
  }

  const std::string& array_;
  const std::vector<const Store*>& filled_;
};

class TryPlainProducts : public StatementRewriter {
 public:
  explicit TryPlainProducts(const Stmt& s) : fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    const auto* storage = s.as<Allocate>();
    const auto* body = storage ? storage->body.as<Block>() : nullptr;
    const Stmt tried = body ? in_storage(storage->name, body->stmts) : Stmt();
    if (!tried.defined()) return children(s);
    return make_allocate(storage->name, storage->type, storage->memory, storage->elements, tried);
  }

 private:
  // The rewritten statements; undefined if they do not have the form above.
  Stmt in_storage(const std::string& array, const std::vector<Stmt>& stmts) {
    std::vector<const Store*> filled;
    auto sums = stmts.begin();
    for (; sums != stmts.end(); ++sums) {
      const auto* fill = sums->as<Store>();
      if (!fill || fill->name != array || fill->predicate.defined() ||
          loads_from(fill->value, array) || loads_from(fill->index, array))
        break;
      filled.push_back(fill);
    }
    SumsInto sum(array, filled);
    auto rest = sums;
    while (rest != stmts.end() && sum.holds(*rest)) ++rest;
    if (filled.empty() || !sum.has_loops || !sum.has_strong_products) return {};
    std::vector<Stmt> result(stmts.begin(), sums), again;
    for (auto s = sums; s != rest; ++s) result.push_back(plain(*s));
    for (auto s = stmts.begin(); s != rest; ++s) again.push_back(copy_statement(*s, fresh_));
    result.push_back(make_if(any_is_nan(filled), make_block(again)));
    for (auto s = rest; s != stmts.end(); ++s) result.push_back((*this)(*s));
    return make_block(result);
  }

  static Stmt plain(const Stmt& s) {
    return rewrite_statements(s, [](const Stmt& part, auto& all) {
      const auto* store = part.template as<Store>();
      if (!store) return all.children(part);
      return make_store(store->name, with_plain_products(store->value), store->index,
                        store->predicate, store->symbol);
    });
  }

  // Checks all sums at once: a NaN stays in a sum of sums.
  static Expr any_is_nan(const std::vector<const Store*>& filled) {
    std::vector<Expr> sums;  // one per number of lanes
    for (const Store* fill : filled) {
      const Expr value = make_load(fill->value.type(), fill->name, fill->index);
      const auto same = std::find_if(sums.begin(), sums.end(),
                                     [&](const Expr& sum) { return sum.type() == value.type(); });
      if (same == sums.end())
        sums.push_back(value);
      else
        *same = *same + value;
    }
    Expr result;
    for (const Expr& sum : sums) {
      Expr is_nan = call_op(Op::is_nan, Bool(sum.type().lanes()), {sum});
      if (!sum.type().is_scalar()) is_nan = make_vector_reduce(Kind::Or, is_nan, 1);
      result = result.defined() ? result || is_nan : is_nan;
    }
    return result;
  }

  FreshNames fresh_;
};

}  // namespace

Stmt try_plain_products(const Stmt& s) { return s.defined() ? TryPlainProducts(s)(s) : s; }

}  // namespace retrograde::lower
