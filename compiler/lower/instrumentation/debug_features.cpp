// debug_features -- insert checks that help to find faults, for targets that request them.
//
// check_promises. In: Loops, regions known. Out: Loops; the promises stay, around checked values.
//
//   f(unsafe_promise_clamped(g(x), 0, 9))   =>
//     f(unsafe_promise_clamped(require(0 <= g(x) && g(x) <= 9, g(x), "..."), 0, 9))
//
// fuzz_float_stores. In: Vector. Out: Vector.
//
//   f[x] = v   =>   f[x] = reinterpret<float>(reinterpret<uint32>(v) & ~1)
//
// A NaN is stored unchanged: without its last bit it could be an infinity. Atomic statements stay unchanged, because
// they compare the values they read with stored values.
// Tests: test/golden/lower/check_promises/, fuzz_float_stores/.
#include "lower/statement_passes.h"

#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {
namespace {

Expr without_last_bit(const Expr& value) {
  const Type type = value.type(), bits = type.with_code(TypeCode::UInt);
  const Expr mask = make_uint_const(bits, ~uint64_t{1} >> (64 - type.bits()) & ~uint64_t{1});
  const Expr cleared =
      reinterpret_as(type, call_op(Op::bitwise_and, bits, {reinterpret_as(bits, value), mask}));
  return make_select(value == value, cleared, value);
}

}  // namespace

Stmt check_promises(const Stmt& s) {
  return rewrite(s, [](const Expr& e, const auto& recurse) -> Expr {
    const auto* call = as_op(e, Op::unsafe_promise_clamped);
    if (!call) return {};
    const Expr value = recurse(call->args[0]), min = recurse(call->args[1]),
               max = recurse(call->args[2]);
    const Expr checked = call_op(
        Op::require, value.type(),
        {min <= value && value <= max, value,
         Expr("cannot run: unsafe_promise_clamped() promises a value between"), min, Expr("and"),
         max, Expr("but it is"), value, Expr("here. Use clamp(), or mend what computes it.")});
    return call_op(Op::unsafe_promise_clamped, e.type(), {checked, min, max});
  });
}

Stmt fuzz_float_stores(const Stmt& all) {
  return rewrite_statements(all, [](const Stmt& s, auto& rewriter) {
    if (s.as<Atomic>()) return s;
    const auto* store = s.as<Store>();
    if (!store || !store->value.type().is_float()) return rewriter.children(s);
    return make_store(store->name, without_last_bit(store->value), store->index, store->predicate,
                      store->symbol);
  });
}

}  // namespace retrograde::lower
