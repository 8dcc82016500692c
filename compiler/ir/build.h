// Node builders: they check types, fold constants and apply the few identities that always hold,
// and do no other simplification. Also declares the C++ operators on Expr, with Halide's promotion
// rules.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnostics/error.h"
#include "ir/expr.h"

namespace retrograde {

namespace ir {

Expr make_const(Type type, int64_t value);  // broadcast when the type has several lanes
Expr make_const(Type type, double value);
inline Expr make_const(Type type, int value) {
  return make_const(type, static_cast<int64_t>(value));
}
Expr make_uint_const(Type type, uint64_t value);
Expr make_zero(Type type);
Expr make_one(Type type);
Expr const_true(int lanes = 1);
Expr const_false(int lanes = 1);

std::optional<int64_t> as_const_int(
    const Expr& e);  // when `e` is an Int or UInt immediate (or a broadcast of one) that fits int64
std::optional<double> as_const_float(const Expr& e);
bool is_const(const Expr& e);
bool is_zero(const Expr& e);  // +0.0 and -0.0 both
bool is_one(const Expr& e);
bool is_const_true(const Expr& e);
bool is_const_false(const Expr& e);
bool is_const_int(const Expr& e, int64_t value);

Expr variable(const std::string& name, Type type = Int(32), SymbolRef symbol = {});
// A variable that no definition owns yet: a reduction variable as users write it. Folding keeps
// every operand that mentions one. For example r * 0 is not folded, because the definition that
// eventually contains it runs over the domain of r. `settled` is called by that definition and
// returns the same expressions over plain variables, folded.
Expr loose_variable(const std::string& name, Type type = Int(32), SymbolRef symbol = {});
std::vector<Expr> settled(std::vector<Expr> exprs);  // sharing is preserved
// An int32 variable for each name: the arguments in a Func's definition.
std::vector<Expr> variables_of(const std::vector<std::string>& names);
// `a` and `b` must already have one type; a scalar beside a vector is broadcast.
Expr binary(Kind kind, Expr a, Expr b);
Expr logical_not(Expr a);
// Keeps or broadcasts lanes; folds; returns `value` when it has the type already.
Expr cast_to(Type type, Expr value);
Expr reinterpret_as(Type type, Expr value);
Expr make_select(Expr condition, Expr when_true, Expr when_false);  // arms must have one type
Expr make_load(Type type, const std::string& name, Expr index, Expr predicate = {},
               SymbolRef symbol = {});
Expr make_ramp(Expr base, Expr stride, int lanes);
Expr make_broadcast(Expr value, int lanes);
Expr make_let(const std::string& name, Expr value, Expr body);
Expr make_shuffle(std::vector<Expr> vectors, std::vector<int> indices);
// Vectors of one width, as lanes a0 b0 ... a1 b1 ...
Expr make_interleaved(const std::vector<Expr>& vectors);
Expr make_vector_reduce(Kind op, Expr value, int result_lanes);
// An operator with an explicit result type; the overload without one uses the first argument's
// type.
Expr call_op(Op op, Type type, std::vector<Expr> args);
Expr call_op(Op op, std::vector<Expr> args);  // has the first argument's type
Expr call_extern(const std::string& name, Type type, std::vector<Expr> args, bool is_pure = false);
Expr call_func(const std::string& name, Type type, std::vector<Expr> args, int component,
               SymbolRef symbol);
Expr call_image(const std::string& name, Type type, std::vector<Expr> args, SymbolRef symbol);
// Requires: every operand must be a defined expression.
Expr likely(Expr e);
Expr conjunction(const std::vector<Expr>& terms);  // true when empty
// Appends the operands of the conjunction `e`; appends nothing when `e` is undefined.
void add_conjuncts(const Expr& e, std::vector<Expr>& conjuncts);
// Adds a term to a sum. An empty sum is undefined.
void add_term(Expr& sum, const Expr& term);

Stmt make_let(const std::string& name, Expr value, Stmt body);
// Names and the values bound to them, outermost first, wrapped around a body.
using Lets = std::vector<std::pair<std::string, Expr>>;
Expr make_lets(const Lets& lets, Expr body);
Stmt make_lets(const Lets& lets, Stmt body);
Stmt make_assert(Expr condition, Expr error);
Stmt make_producer_consumer(const std::string& name, bool produces, Stmt body);
Stmt make_launch(const std::string& kernel, std::vector<Expr> blocks, std::vector<int> threads,
                 Expr shared_bytes, Stmt body);
Stmt make_for(const std::string& name, Expr min, Expr extent, ForType type, Stmt body,
              Partition partition = Partition::Auto);
Stmt make_store(const std::string& name, Expr value, Expr index, Expr predicate = {},
                SymbolRef symbol = {});
Stmt make_provide(const std::string& name, std::vector<Expr> values, std::vector<Expr> args,
                  Expr predicate = {});
Stmt make_realize(const std::string& name, std::vector<Type> types, MemoryType memory,
                  std::vector<Range> bounds, Stmt body, StorageLayout layout = {});
// The same storage around another statement, or with other bounds.
Stmt with_body(const Realize& n, Stmt body);
Stmt with_bounds(const Realize& n, std::vector<Range> bounds, Stmt body);
Stmt make_allocate(const std::string& name, Type type, MemoryType memory, Expr elements, Stmt body,
                   Expr offset = {});
Stmt make_free(const std::string& name);
// Flattens nested blocks, drops undefined ones; undefined when empty; unwraps a single one.
Stmt make_block(std::vector<Stmt> stmts);
Stmt make_if(Expr condition, Stmt when_true, Stmt when_false = {});
// `old` with new children; returns `old` itself when they are unchanged.
Stmt with_parts(const IfThenElse& old, Expr condition, Stmt when_true, Stmt when_false);
Stmt make_evaluate(Expr value);
Stmt make_atomic(const std::string& name, Stmt body);
Stmt make_fork(Stmt first, Stmt rest);
Stmt make_prefetch(const std::string& name, Type type, std::vector<Range> bounds,
                   SymbolRef symbol = {});

// Applies Halide's promotion: integers become floats beside floats, types widen, mixed signs become
// signed, scalars are broadcast to vectors. Throws UserError that names the operation `what` when
// there is no common type.
void match_types(Expr& a, Expr& b, const char* what);
// The constant `value` in the type of `other`; UserError when it does not fit.
Expr constant_like(const Expr& other, int64_t value, const char* what);

}  // namespace ir

// ---- C++ operators on Expr ----

// A C++ integer beside an Expr takes the Expr's type, and must fit it (UserError). This is a
// template because a plain `int` parameter would also accept `e + 0.5f`. C++ floats become Exprs of
// their own type.
template <class T>
concept IntegerConstant = std::is_integral_v<T> && !std::is_same_v<T, bool>;

namespace ir {
template <IntegerConstant T>
Expr constant_for(const Expr& other, T value, const char* what) {
  if constexpr (std::is_same_v<T, uint64_t> || std::is_same_v<T, unsigned long long>) {
    if (value > static_cast<uint64_t>(INT64_MAX)) return make_uint_const(UInt(64), value);
  }
  return constant_like(other, static_cast<int64_t>(value), what);
}
}  // namespace ir

// Requires: both operands must be defined; operands must be numbers; both operands must have a
// common type; a constant takes the type of the other operand and must fit it.
#define RETROGRADE_DECLARE_OPERATOR(name)           \
  Expr name(Expr a, Expr b);                        \
  template <IntegerConstant T>                      \
  Expr name(Expr a, T b) {                          \
    Expr constant = ir::constant_for(a, b, #name);  \
    return name(std::move(a), std::move(constant)); \
  }                                                 \
  template <IntegerConstant T>                      \
  Expr name(T a, Expr b) {                          \
    Expr constant = ir::constant_for(b, a, #name);  \
    return name(std::move(constant), std::move(b)); \
  }
RETROGRADE_DECLARE_OPERATOR(operator+)
RETROGRADE_DECLARE_OPERATOR(operator-)
RETROGRADE_DECLARE_OPERATOR(operator*)
RETROGRADE_DECLARE_OPERATOR(operator/)
RETROGRADE_DECLARE_OPERATOR(operator%)
RETROGRADE_DECLARE_OPERATOR(operator<)
RETROGRADE_DECLARE_OPERATOR(operator<=)
RETROGRADE_DECLARE_OPERATOR(operator>)
RETROGRADE_DECLARE_OPERATOR(operator>=)
RETROGRADE_DECLARE_OPERATOR(operator==)
RETROGRADE_DECLARE_OPERATOR(operator!=)
RETROGRADE_DECLARE_OPERATOR(min)
RETROGRADE_DECLARE_OPERATOR(max)
#undef RETROGRADE_DECLARE_OPERATOR
// Requires: operands must be bool.
Expr operator&&(Expr a, Expr b);
Expr operator||(Expr a, Expr b);
Expr operator!(Expr a);
Expr operator-(Expr a);
Expr& operator+=(Expr& a, Expr b);
Expr& operator-=(Expr& a, Expr b);
Expr& operator*=(Expr& a, Expr b);
Expr& operator/=(Expr& a, Expr b);
// Requires: both operands must be defined; the new type must be a number; integers have 1, 8, 16,
// 32 or 64 bits, floats 16, 32 or 64.
Expr cast(Type type, Expr value);
Expr select(Expr condition, Expr when_true, Expr when_false);  // promotes the arms
// Requires: both operands must be defined; a bound is a value of the type that is clamped.
Expr clamp(Expr value, Expr low, Expr high);  // low and high take value's type

}  // namespace retrograde
