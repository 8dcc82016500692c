// overflow.cpp -- evaluates constants in int64, with overflow detected by compiler builtins.
#include "ir/overflow.h"

#include <optional>
#include <utility>

#include "ir/build.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

bool overflows_int64(Kind kind, int64_t a, int64_t b, int64_t& result) {
  if (kind == Kind::Add) return __builtin_add_overflow(a, b, &result);
  if (kind == Kind::Sub) return __builtin_sub_overflow(a, b, &result);
  return __builtin_mul_overflow(a, b, &result);
}

bool overflows(Kind kind, const Expr& a, const Expr& b) {
  const Type type = a.type();
  if (!type.is_int() || type.can_overflow_int()) return false;
  const std::optional<int64_t> x = as_const_int(a), y = x ? as_const_int(b) : std::nullopt;
  if (!y) return false;
  int64_t result = 0;
  return overflows_int64(kind, *x, *y, result) || wrap_int(type.bits(), result) != result;
}

template <class Node>
bool overflows(const Expr& e, Kind kind) {
  const Node* node = e.as<Node>();
  return node && overflows(kind, node->a, node->b);
}

}  // namespace

Expr arithmetic(Kind kind, Expr a, Expr b) {
  if (!overflows(kind, a, b)) return binary(kind, std::move(a), std::move(b));
  const Type type = a.type();
  if (kind == Kind::Add) return new Add(type, std::move(a), std::move(b));
  if (kind == Kind::Sub) return new Sub(type, std::move(a), std::move(b));
  return new Mul(type, std::move(a), std::move(b));
}

Expr overflowing_part(const Expr& root) {
  Expr part;
  walk(root, [&](const Expr& e) {
    if (overflows<Add>(e, Kind::Add) || overflows<Sub>(e, Kind::Sub) ||
        overflows<Mul>(e, Kind::Mul))
      part = e;
    return !part.defined();
  });
  return part;
}

}  // namespace retrograde::ir
