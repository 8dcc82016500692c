// The constant range of each node, from the ranges of its operands and from facts.
#include <algorithm>
#include <numeric>

#include "ir/build.h"
#include "ir/scalar.h"
#include "ir/visit.h"
#include "simplify/facts.h"

namespace retrograde::simplification {

ConstantRange Facts::range(const Expr& e) {
  if (const std::optional<int64_t> value =
          as_const_int(e)) {  // the extremes of int64 also represent infinity
    return {*value == INT64_MAX ? *value - 1 : *value, *value == INT64_MIN ? *value + 1 : *value};
  }
  if (!e.type().is_int_or_uint()) return {};
  return ranges_.get(e, [&] {
    const ConstantRange all_values = range_of(e.type());
    const ConstantRange result = intersection(range_of_node(e), all_values);
    return result.min > result.max ? all_values : result;  // contradictory facts: unreachable code
  });
}

ConstantRange Facts::range_of_variable(const Expr& e, const Variable& n) {
  ConstantRange result;
  if (const auto found = variables_.find(n.name); found != variables_.end())
    result = found->second.range;
  if (!index_.empty() && is_index_type(n.type)) {
    const int64_t low = known_bound(e, -1);
    result = intersection(result, {low == infinity ? INT64_MIN : -low, known_bound(e, 1)});
  }
  return result;
}

ConstantRange Facts::range_of_node(const Expr& e) {
  const ConstantRange all_values = range_of(e.type());
  return match(
      e, [&](const Variable& n) { return range_of_variable(e, n); },
      [&](const Cast& n) {
        if (!n.value.type().is_int_or_uint() || n.type.is_bool()) return all_values;
        const ConstantRange source = range(n.value);
        return source.is_within(all_values) &&
                       !(n.value.type() == UInt(64) && source.max == infinity)
                   ? source
                   : all_values;
      },
      [&](const Binary& n) { return range_of_binary(n); },
      [&](const Select& n) { return hull(range(n.when_true), range(n.when_false)); },
      [&](const Ramp& n) {
        const ConstantRange steps = multiply(range(n.stride), {0, n.lanes - 1});
        return wrapped(range(n.base) + steps, n.type);
      },
      [&](const Broadcast& n) { return range(n.value); },
      [&](const Let& n) { return range(n.body); },
      [&](const VectorReduce& n) {
        return n.op == Kind::Min || n.op == Kind::Max ? range(n.value) : all_values;
      },
      [&](const Shuffle& n) {
        ConstantRange result = range(n.vectors[0]);
        for (const Expr& v : n.vectors) result = hull(result, range(v));
        return result;
      },
      [&](const Call& n) { return range_of_call(n); }, [&](const ExprNode&) { return all_values; });
}

ConstantRange Facts::range_of_binary(const Binary& n) {
  const ConstantRange all_values = range_of(n.type);
  if (!n.a.type().is_int_or_uint() || n.type.is_bool()) return all_values;
  const ConstantRange a = range(n.a), b = range(n.b);
  switch (n.kind) {
    case Kind::Add:
      return wrapped(a + b, n.type);
    case Kind::Sub:
      return wrapped(a + b * -1, n.type);
    case Kind::Mul:
      return wrapped(multiply(a, b), n.type);
    case Kind::Div:
      return wrapped(divide(a, b), n.type);
    case Kind::Mod:
      return intersection(modulo(a, b), range_of_remainder(n));
    case Kind::Min:
      return {std::min(a.min, b.min), std::min(a.max, b.max)};
    case Kind::Max:
      return {std::max(a.min, b.min), std::max(a.max, b.max)};
    default:
      return all_values;
  }
}

// x % c, for x congruent to r modulo m: the values below c that are congruent to r modulo gcd(m, c).
ConstantRange Facts::range_of_remainder(const Binary& n) {
  const std::optional<int64_t> divisor = as_const_int(n.b);
  if (!divisor || *divisor <= 0 || !is_index_type(n.type)) return range_of(n.type);
  const Congruence known = congruence(n.a);
  const int64_t step = std::gcd(known.modulus, *divisor);
  const int64_t first = euclidean_mod(known.remainder, step);
  return {first, *divisor - step + first};
}

ConstantRange Facts::range_of_call(const Call& n) {
  const ConstantRange all_values = range_of(n.type);
  if (n.call_type != CallType::Operator) return all_values;
  switch (n.op) {
    case Op::promise_clamped:
    case Op::unsafe_promise_clamped:
      return intersection(range(n.args[0]), {range(n.args[1]).min, range(n.args[2]).max});
    case Op::bitwise_and: {  // at most a nonnegative constant operand
      const ConstantRange mask = range(n.args[1]);
      return mask.min >= 0 ? ConstantRange{0, mask.max} : all_values;
    }
    case Op::popcount:
    case Op::count_leading_zeros:
    case Op::count_trailing_zeros:
      return {0, n.type.bits()};
    case Op::if_then_else:
      return hull(range(n.args[1]), range(n.args[2]));
    default:
      return n.is_marker() ? range(n.args[0]) : all_values;
  }
}

}  // namespace retrograde::simplification
