// Method: a clamp as a function of its value rises by 1 between its ends and by 0 elsewhere. The
// difference of two clamps therefore rises exactly where one of them rises and the other does not.
#include "ir/join_clamps.h"

#include <algorithm>
#include <optional>

#include "ir/build.h"

namespace retrograde::ir {

namespace {

constexpr __int128 infinite = __int128{1} << 100;

// The interval between two ends.
struct Span {
  __int128 low = -infinite, high = infinite;
  bool operator==(const Span& other) const { return low == other.low && high == other.high; }
  __int128 nearest(__int128 place) const { return std::clamp(place, low, high); }
  __int128 finite_end() const { return low > -infinite ? low : high; }
};

// min(max(base + shift, low), high) as a function of `base`.
struct Clamp {
  Sum base;  // without a constant
  int64_t shift = 0;
  Span rises;
  __int128 at(__int128 place) const { return rises.nearest(place) + shift; }
};

// min(value, end) or max(value, end).
struct Cut {
  Kind kind;
  Sum value;
  int64_t end;
};
std::optional<Cut> as_cut(const Expr& e) {
  if (e.kind() != Kind::Min && e.kind() != Kind::Max) return std::nullopt;
  const auto* n = e.as<Binary>();
  const bool is_last = is_const(n->b);
  const std::optional<int64_t> end = as_const_int(is_last ? n->b : n->a);
  if (!end || is_extreme(e.type(), *end)) return std::nullopt;
  return Cut{e.kind(), sum_of(is_last ? n->a : n->b), *end};
}

std::optional<Clamp> as_clamp(const Expr& e) {
  if (!is_index_type(e.type()) || e.type().is_vector()) return std::nullopt;
  const std::optional<Cut> outer = as_cut(e);
  if (!outer || !outer->value.valid) return std::nullopt;
  Clamp result{outer->value};
  const auto cut = [&](Kind kind, __int128 end) {
    (kind == Kind::Min ? result.rises.high : result.rises.low) = end;
  };
  cut(outer->kind, outer->end);
  if (result.base.terms.size() == 1 && result.base.terms[0].factor == 1) {
    const std::optional<Cut> inner = as_cut(result.base.terms[0].atom);
    if (inner && inner->kind != outer->kind && inner->value.valid) {
      const int64_t moved = result.base.constant;
      cut(inner->kind, __int128{inner->end} + moved);
      result.base = inner->value;
      result.base.add_constant(moved);
    }
  }
  if (!result.base.valid || result.rises.low > result.rises.high) return std::nullopt;
  result.shift = result.base.constant;
  result.base.add_constant(-__int128{result.shift});
  const auto is_small = [&](__int128 end) {
    return end == static_cast<int64_t>(end) && !is_extreme(e.type(), static_cast<int64_t>(end));
  };
  for (__int128* end : {&result.rises.low, &result.rises.high}) {
    if (*end == -infinite || *end == infinite) continue;
    *end -= result.shift;
    if (!is_small(*end)) return std::nullopt;
  }
  return result;
}

// `outer` minus `inner`, if that is one interval at an end of `outer`.
std::optional<Span> without(const Span& outer, const Span& inner) {
  if (outer.low == inner.low && inner.high < outer.high) return Span{inner.high, outer.high};
  if (outer.high == inner.high && inner.low > outer.low) return Span{outer.low, inner.low};
  return std::nullopt;
}

bool have_one_base(const Clamp& a, const Clamp& b) {
  const Sum difference = plus(a.base, b.base, -1);
  return difference.valid && difference.is_constant() && difference.constant == 0;
}

}  // namespace

bool join_clamps(Sum& sum, const std::function<Expr(Kind, const Expr&, const Expr&)>& build) {
  const auto is_cut = [](const Term& term) {
    return term.atom.kind() == Kind::Min || term.atom.kind() == Kind::Max;
  };
  if (!is_index_type(sum.type) || std::ranges::count_if(sum.terms, is_cut) < 2) return false;
  for (const Term& x : sum.terms) {
    for (const Term& y : sum.terms) {
      if (x.factor <= 0 || y.factor != -x.factor || !is_cut(x) || !is_cut(y)) continue;
      const std::optional<Clamp> a = as_clamp(x.atom), b = as_clamp(y.atom);
      if (!a || !b || !have_one_base(*a, *b)) continue;
      const std::optional<Span> more = without(a->rises, b->rises),
                                less = without(b->rises, a->rises);
      if (!more && !less && !(a->rises == b->rises)) continue;
      Sum joined = sum;
      joined.add(x.atom, -x.factor);
      joined.add(y.atom, x.factor);
      const Span& left = more ? *more : less ? *less : a->rises;
      const __int128 place = left.finite_end();
      __int128 constant = a->at(place) - b->at(place);
      if (more || less) {
        Expr value = to_expr(a->base);
        if (!value.defined()) continue;
        const auto end = [&](__int128 at) {
          return make_const(sum.type, static_cast<int64_t>(at));
        };
        if (left.high < infinite) value = build(Kind::Min, value, end(left.high));
        if (left.low > -infinite) value = build(Kind::Max, value, end(left.low));
        const int64_t sign = more ? 1 : -1;
        joined.add(sum.is_linear ? linear_sum(value) : sum_of(value), sign * x.factor);
        constant -= sign * place;
      }
      joined.add_constant(constant * x.factor);
      if (!joined.valid) continue;
      sum = std::move(joined);
      return true;
    }
  }
  return false;
}

}  // namespace retrograde::ir
