// A factor fits 16 bits when it is converted from at most 16 bits, or is a small enough constant.
#include "ir/narrow_product.h"

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

bool fits_int16(Type type) {
  return (type.is_int() && type.bits() <= 16) || (type.is_uint() && type.bits() == 8);
}

// The same values as int16; undefined when they may not fit.
Expr narrowed(const Expr& e) {
  const Type narrow = Int(16, e.type().lanes());
  if (const auto constant = as_const_int(e)) {
    return narrow.can_represent(*constant) ? make_const(narrow, *constant) : Expr();
  }
  return match(
      e,
      [&](const Cast& n) { return fits_int16(n.value.type()) ? cast_to(narrow, n.value) : Expr(); },
      [&](const Broadcast& n) {
        const Expr value = narrowed(n.value);
        return value.defined() ? make_broadcast(value, n.lanes) : value;
      },
      [&](const Shuffle& n) -> Expr {
        std::vector<Expr> vectors;
        for (const Expr& vector : n.vectors) {
          vectors.push_back(narrowed(vector));
          if (!vectors.back().defined()) return {};
        }
        return make_shuffle(std::move(vectors), n.indices);
      },
      [](const ExprNode&) { return Expr(); });
}

}  // namespace

std::optional<NarrowProduct> as_narrow_product(const Expr& e) {
  if (e.type().element_of() != Int(32) || e.type().is_scalar() || is_const(e)) return std::nullopt;
  if (const Expr alone = narrowed(e); alone.defined())
    return NarrowProduct{alone, make_one(alone.type())};
  if (const auto* shuffle = e.as<Shuffle>(); shuffle && shuffle->vectors.size() == 1) {
    const auto product = as_narrow_product(shuffle->vectors[0]);
    if (!product) return std::nullopt;
    return NarrowProduct{make_shuffle({product->a}, shuffle->indices),
                         make_shuffle({product->b}, shuffle->indices)};
  }
  if (e.kind() != Kind::Mul) return std::nullopt;
  const auto* product = e.as<Binary>();
  const Expr a = narrowed(product->a), b = narrowed(product->b);
  if (!a.defined() || !b.defined()) return std::nullopt;
  return NarrowProduct{a, b};
}

}  // namespace retrograde::ir
