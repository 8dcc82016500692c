#include "lower/vectors/lane_splitter.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "diagnostics/error.h"

namespace retrograde::lower {

// ramp / c or ramp % c, where stride and c are constants.
struct PeriodicIndex {
  Expr base;
  int64_t stride, divisor;
  int period() const { return static_cast<int>(divisor / std::gcd(stride, divisor)); }
};

namespace {

constexpr int max_pattern_period = 8;

Pattern combine(const Pattern& a, const Pattern& b) {
  const bool has_load = a.has_load || b.has_load;
  const int period = std::lcm(a.period, b.period);
  if (a.kind == Pattern::Whole || b.kind == Pattern::Whole || period > max_pattern_period)
    return {Pattern::Whole, 1, has_load};
  return {std::max(a.kind, b.kind), period, has_load};
}

std::optional<PeriodicIndex> as_periodic_index(const Expr& e) {
  if (e.kind() != Kind::Div && e.kind() != Kind::Mod) return std::nullopt;
  const auto* op = e.as<Binary>();
  const auto* ramp = op->a.as<Ramp>();
  if (!ramp || !ramp->base.type().is_scalar() || !e.type().is_int() || e.type().bits() < 32)
    return std::nullopt;
  const auto stride = as_const_int(ramp->stride), divisor = as_const_int(op->b);
  if (!stride || !divisor || *divisor <= 1 || *divisor > INT32_MAX) return std::nullopt;
  return PeriodicIndex{ramp->base, *stride, *divisor};
}

bool is_elementwise(const Call& call) {
  if (call.call_type != CallType::Operator) return false;
  const OpClass cls = op_info(call.op).cls;
  return cls == OpClass::Pure || cls == OpClass::Marker;
}

}  // namespace

Pattern LaneSplitter::pattern(const Expr& e) {
  if (e.type().is_scalar()) return {};
  if (const auto* found = find_or_null(patterns_, e.get())) return found->pattern;
  Pattern result = find_pattern(e);
  if (result.kind == Pattern::Periodic && e.type().lanes() % result.period != 0)
    result.kind = Pattern::Whole;
  patterns_.emplace(e.get(), Entry{e, result});
  return result;
}

std::vector<Expr> LaneSplitter::parts(const Expr& e, int period) {
  std::vector<Expr> result;
  for (int first = 0; first < period; ++first) {
    first_ = first;
    period_ = period;
    memo_.clear();
    result.push_back(part(e));
  }
  return result;
}

void LaneSplitter::bind(const std::string& name, const Expr& value, const Pattern& p) {
  names_[name] = {p, value, {}};
}

void LaneSplitter::bind(const std::string& name, const std::vector<Expr>& part_variables) {
  const int period = static_cast<int>(part_variables.size());
  names_[name] = {{Pattern::Periodic, period, true}, {}, part_variables};
}

Pattern LaneSplitter::find_pattern(const Expr& e) {
  return match(
      e, [&](const Variable& n) { return pattern_of_name(n); },
      [&](const Broadcast& n) { return n.value.type().is_scalar() ? Pattern{} : whole_pattern; },
      [&](const Ramp& n) { return n.base.type().is_scalar() ? Pattern{} : whole_pattern; },
      [&](const Binary& n) {
        if (const auto index = as_periodic_index(e))
          return index->period() > max_pattern_period
                     ? Pattern{}
                     : Pattern{index->period() == 1 ? Pattern::Any : Pattern::Periodic,
                               index->period(), false};
        return combine(pattern(n.a), pattern(n.b));
      },
      [&](const Not& n) { return pattern(n.a); }, [&](const Cast& n) { return pattern(n.value); },
      [&](const Select& n) {
        return combine(pattern(n.condition), combine(pattern(n.when_true), pattern(n.when_false)));
      },
      [&](const Load& n) { return pattern_of_load(n); },
      [&](const Let& n) {
        if (n.value.type().is_scalar()) return whole_pattern;
        const Pattern of_value = pattern(n.value);
        bind(n.name, n.value, of_value);
        return combine({Pattern::Any, of_value.period, of_value.has_load}, pattern(n.body));
      },
      [&](const Call& n) {
        Pattern result = is_elementwise(n) ? Pattern{} : whole_pattern;
        for (const Expr& arg : n.args) result = combine(result, pattern(arg));
        return result;
      },
      [&](const ExprNode&) { return whole_pattern; });
}

Pattern LaneSplitter::pattern_of_name(const Variable& n) const {
  const auto found = names_.find(n.name);
  return found == names_.end() ? whole_pattern : found->second.pattern;
}

Pattern LaneSplitter::pattern_of_load(const Load& n) {
  Pattern result = pattern(n.index);
  if (n.predicate.defined()) result = combine(result, pattern(n.predicate));
  const auto* ramp = n.index.as<Ramp>();
  if (ramp && !is_zero(ramp->stride)) result.kind = Pattern::Whole;
  result.has_load = true;
  return result;
}

Expr LaneSplitter::part(const Expr& e) {
  if (e.type().is_scalar()) return e;
  return memo_.get(e, [&] { return make_part(e); });
}

Expr LaneSplitter::make_part(const Expr& e) {
  const int lanes = e.type().lanes() / period_;
  return match(
      e,
      [&](const Variable& n) {
        const Named& named = names_.at(n.name);
        return named.parts.empty() ? part(named.value) : part_of_parts(named.parts, lanes);
      },
      [&](const Let& n) { return part(n.body); },
      [&](const Broadcast& n) { return make_broadcast(n.value, lanes); },
      [&](const Ramp& n) {
        const Type type = n.base.type();
        return make_sequence(
            binary(Kind::Add, n.base, binary(Kind::Mul, n.stride, make_const(type, first_))),
            binary(Kind::Mul, n.stride, make_const(type, period_)), lanes);
      },
      [&](const Binary& n) {
        const auto index = as_periodic_index(e);
        return index && index->stride * period_ % index->divisor == 0
                   ? part_of_index(e.kind(), *index, lanes)
                   : binary(e.kind(), part(n.a), part(n.b));
      },
      [&](const Not& n) { return logical_not(part(n.a)); },
      [&](const Cast& n) { return cast_to(n.type.with_lanes(lanes), part(n.value)); },
      [&](const Select& n) {
        return make_select(part(n.condition), part(n.when_true), part(n.when_false));
      },
      [&](const Load& n) {
        const Expr predicate = n.predicate.defined() ? part(n.predicate) : Expr();
        return make_load(n.type.with_lanes(lanes), n.name, part(n.index), predicate, n.symbol);
      },
      [&](const Call& n) {
        std::vector<Expr> args = mapped(n.args, [&](const Expr& arg) { return part(arg); });
        return call_op(n.op, n.type.with_lanes(lanes), std::move(args));
      },
      [&](const ExprNode&) -> Expr { internal_error("interleave_vectors: no parts"); });
}

Expr LaneSplitter::part_of_parts(const std::vector<Expr>& parts, int lanes) const {
  const int count = static_cast<int>(parts.size()), step = period_ / count;
  const Expr& whole_part = parts.at(static_cast<size_t>(first_ % count));
  if (step == 1) return whole_part;
  std::vector<int> indices = numbered(lanes, [&](int i) { return first_ / count + i * step; });
  return make_shuffle({whole_part}, std::move(indices));
}

Expr LaneSplitter::part_of_index(Kind kind, const PeriodicIndex& index, int lanes) const {
  const Type type = index.base.type();
  const Expr start = binary(Kind::Add, index.base, make_const(type, index.stride * first_));
  const Expr value = binary(kind, start, make_const(type, index.divisor));
  if (kind == Kind::Mod) return make_sequence(value, make_zero(type), lanes);
  const int64_t step = index.stride * period_ / index.divisor;
  return make_sequence(value, make_const(type, step), lanes);
}

Expr LaneSplitter::make_sequence(const Expr& base, const Expr& stride, int lanes) {
  if (lanes == 1) return base;
  return is_zero(stride) ? make_broadcast(base, lanes) : make_ramp(base, stride, lanes);
}

}  // namespace retrograde::lower
