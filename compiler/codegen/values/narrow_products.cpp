// Sums of 16-bit products in 32-bit lanes. One x86 instruction (pmaddwd) multiplies twice as many of them and adds
// neighbouring products:
//
//   reduce(add, int32(a) * int32(b))     pairs that already are neighbours
//   int32(a) * k + int32(b) * l          neighbours in the interleaved vectors a0 b0 a1 b1 ... and
//                                        k l k l ...; worth it if k and l are uniform
#include "codegen/values/values.h"
#include "ir/build.h"
#include "ir/narrow_product.h"

namespace retrograde::codegen {

using namespace ir;

// With fewer lanes the shuffles cost as much as the products save.
constexpr int min_lanes = 8;
// Longer sums are left alone. So a sum of shared sums costs no more than this to analyse.
constexpr size_t max_terms = 64;

Value* partly_reduced(Values& values, const VectorReduce& e) {
  const bool has_pairs = e.value.type().lanes() / e.type.lanes() % 2 == 0;
  if (e.op == Kind::Add && has_pairs && values.c.e.machine.is_x86()) {
    if (const auto product = as_narrow_product(e.value))
      return add_products_in_pairs(values.c.e, values.of(product->a), values.of(product->b));
  }
  return values.of(e.value);
}

// The terms of a sum; false when there are too many.
static bool split_sum(const Expr& e, std::vector<Expr>& terms) {
  if (terms.size() >= max_terms) return false;
  if (const auto* sum = e.as<Add>()) return split_sum(sum->a, terms) && split_sum(sum->b, terms);
  terms.push_back(e);
  return true;
}

// A product of a vector and a scalar.
static bool is_scaled(const Expr& e) {
  const auto* product = e.as<Mul>();
  return product && (product->a.as<Broadcast>() || product->b.as<Broadcast>());
}

// The terms may be added in any order, because signed overflow is undefined in the language and wraps here.
Value* sum_of_products(Values& values, const Expr& e) {
  const Type type = e.type();
  const bool may_have_pairs = e.kind() == Kind::Add && type.element_of() == Int(32) &&
                              type.lanes() >= min_lanes && type.lanes() % 2 == 0;
  std::vector<Expr> terms, others;
  if (!may_have_pairs || !values.c.e.machine.is_x86() || !split_sum(e, terms)) return nullptr;
  std::vector<NarrowProduct> products;
  for (const Expr& term : terms) {
    const auto product = is_scaled(term) ? as_narrow_product(term) : std::nullopt;
    product ? products.push_back(*product) : others.push_back(term);
  }
  if (products.size() < 2) return nullptr;
  Value* sum = nullptr;
  const auto add = [&](Value* part) { sum = sum ? values.c.b.CreateAdd(sum, part) : part; };
  for (size_t i = 0; i + 1 < products.size(); i += 2) {
    const NarrowProduct &one = products[i], &other = products[i + 1];
    add(add_products_in_pairs(values.c.e,
                              interleave(values.c.e, {values.of(one.a), values.of(other.a)}),
                              interleave(values.c.e, {values.of(one.b), values.of(other.b)})));
  }
  if (products.size() % 2) {
    const NarrowProduct& last = products.back();
    add(values.c.b.CreateMul(convert(values.c.e, type, last.a.type(), values.of(last.a)),
                             convert(values.c.e, type, last.b.type(), values.of(last.b))));
  }
  for (const Expr& other : others) add(values.of(other));
  return sum;
}

}  // namespace retrograde::codegen
