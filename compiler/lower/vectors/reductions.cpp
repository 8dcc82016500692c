// Minus zero is the identity of floating-point addition: 0 + -0 is 0, and -0 + -0 is -0.
#include "lower/vectors/reductions.h"

#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::lower {

namespace {

Expr scalar_identity(Kind op, Type type) {
  switch (op) {
    case Kind::Add:
      return type.is_float() ? make_const(type, -0.0) : make_zero(type);
    case Kind::Min:
      return type.max();
    case Kind::Max:
      return type.min();
    case Kind::Or:
      return make_zero(type);
    case Kind::Mul:
    case Kind::And:
      return make_one(type);
    default:
      internal_error(text("no vector is reduced by ", kind_name(op)));
  }
}

}  // namespace

Expr identity_of(Kind op, Type type) {
  return make_broadcast(scalar_identity(op, type.element_of()), type.lanes());
}

std::optional<UpdateChain> find_vector_reduction(const Store& store) {
  auto chain = find_update_chain(store);
  const bool is_reduced =
      chain && chain->kind != Kind::Call && !chain->own.as<Load>()->predicate.defined();
  return is_reduced ? chain : std::nullopt;
}

}  // namespace retrograde::lower
