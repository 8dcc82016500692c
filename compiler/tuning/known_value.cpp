#include "tuning/known_value.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::tuning {

int KnownValue::deepest() const { return 63 - std::countl_zero(depends); }

namespace {

uint64_t mix(uint64_t a, uint64_t b) {
  uint64_t x = a * 0x9e3779b97f4a7c15u + b + 0x7f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}
uint64_t number_of(const std::string& text) {
  uint64_t result = text.size();
  for (const char c : text) result = mix(result, static_cast<unsigned char>(c));
  return result;
}
uint64_t number_of(Type type) {
  return mix(static_cast<uint64_t>(type.code()) * 1000 + static_cast<uint64_t>(type.bits()),
             static_cast<uint64_t>(type.lanes()));
}

KnownValue constant(double value) {
  KnownValue result;
  result.at = result.low = result.high = value;
  return result;
}

KnownValue condition(double probability) {
  KnownValue result = constant(probability);
  result.low = probability > 0 ? 1 : 0;
  result.high = 1;
  return result;
}

double bounded(double x) { return std::isnan(x) ? 0 : std::clamp(x, -unbounded, unbounded); }

// Of an operation on both: what it depends on, and that it has lanes.
void depend_on(KnownValue& result, const KnownValue& other) {
  result.depends |= other.depends;
  result.from_data = result.from_data || other.from_data;
}

std::vector<double> combined(const KnownValue& a, double times_a, const KnownValue& b,
                             double times_b) {
  std::vector<double> result(std::max(a.slopes.size(), b.slopes.size()));
  for (size_t i = 0; i < result.size(); i++)
    result[i] = times_a * a.slope(i) + times_b * b.slope(i);
  return result;
}

Lanes scaled(Lanes lanes, double times) {
  lanes.step *= times;
  lanes.outer_step *= times;
  return lanes;
}

Lanes sum_lanes(const Lanes& a, const Lanes& b, double sign) {
  if (b.is_uniform()) return a.count >= b.count ? a : Lanes{b.count, b.inner};
  if (a.is_uniform()) return scaled(b, sign);
  Lanes result = a;
  result.any = a.any || b.any || a.inner != b.inner;
  result.bent = a.bent || b.bent;
  result.step += sign * b.step;
  result.outer_step += sign * b.outer_step;
  return result;
}

Lanes any_lanes(const Lanes& a, const Lanes& b) {
  Lanes result;
  result.count = result.inner = std::max(a.count, b.count);
  result.any = !a.is_uniform() || !b.is_uniform();
  return result;
}

KnownValue sum_of(const KnownValue& a, const KnownValue& b, double sign) {
  KnownValue result;
  result.at = a.at + sign * b.at;
  result.low = bounded(a.low + (sign > 0 ? b.low : -b.high));
  result.high = bounded(a.high + (sign > 0 ? b.high : -b.low));
  result.slopes = combined(a, 1, b, sign);
  result.lanes = sum_lanes(a.lanes, b.lanes, sign);
  return result;
}

KnownValue product_of(const KnownValue& a, const KnownValue& b) {
  KnownValue result;
  result.at = a.at * b.at;
  const auto ends = {bounded(a.low * b.low), bounded(a.low * b.high), bounded(a.high * b.low),
                     bounded(a.high * b.high)};
  result.low = std::min(ends);
  result.high = std::max(ends);
  result.slopes = combined(a, b.at, b, a.at);
  if (b.lanes.is_uniform())
    result.lanes = scaled(a.lanes, b.at),
    result.lanes.count = std::max(a.lanes.count, b.lanes.count);
  else
    result.lanes = a.lanes.is_uniform() ? scaled(b.lanes, a.at) : any_lanes(a.lanes, b.lanes);
  return result;
}

bool is_integer(const Expr& e) { return !e.type().is_float(); }

// Whether the lanes of an index that is divided or wrapped have a form: a period ends with each vector, or holds all of it.
bool are_in_periods(const Lanes& lanes, double period) {
  const double step = std::abs(lanes.step), all = step * lanes.inner;
  return all == 0 || std::fmod(step, period) == 0 || std::fmod(all, period) == 0 ||
         std::fmod(period, all) == 0;
}

KnownValue quotient_of(const KnownValue& a, const KnownValue& b, bool whole) {
  if (b.at == 0) return constant(0);
  const auto divided = [&](double x) {
    const double q = bounded(x / b.at);
    return whole && std::abs(q) < unbounded ? std::floor(q) : q;
  };
  KnownValue result;
  result.at = divided(a.at);
  result.low = std::min(divided(a.low), divided(a.high));
  result.high = std::max(divided(a.low), divided(a.high));
  result.slopes = combined(a, 1 / b.at, b, 0);
  result.lanes = b.lanes.is_uniform() ? scaled(a.lanes, 1 / b.at) : any_lanes(a.lanes, b.lanes);
  if (whole && !result.lanes.is_uniform()) {
    result.lanes.bent = true;
    if (!are_in_periods(a.lanes, std::abs(b.at))) result.lanes.any = true;
  }
  return result;
}

KnownValue remainder_of(const KnownValue& a, const KnownValue& b) {
  if (b.at == 0) return constant(0);
  const double period = std::abs(b.at);
  const auto rest = [&](double x) { return x - period * std::floor(x / period); };
  KnownValue result = a;
  result.at = rest(a.at);
  const bool stays = std::floor(a.low / period) == std::floor(a.high / period);
  result.low = stays ? rest(a.low) : 0;
  result.high = stays ? rest(a.high) : period - 1;
  for (double& slope : result.slopes)
    if (rest(slope) == 0) slope = 0;
  if (!a.lanes.is_uniform() && !stays) {
    result.lanes.bent = true;
    if (!are_in_periods(a.lanes, period)) result.lanes.any = true;
  }
  return result;
}

// The operand that decides in the middle; lanes bend where it is the other one.
KnownValue extreme_of(const KnownValue& a, const KnownValue& b, bool is_min) {
  const bool first = is_min ? a.at <= b.at : a.at >= b.at;
  const bool a_only = is_min ? a.high <= b.low : a.low >= b.high;
  const bool b_only = is_min ? b.high <= a.low : b.low >= a.high;
  // A ramp that is held inside bounds is one but at its ends.
  const bool takes_a = a_only || (!b_only && (first || !a.lanes.is_uniform()) &&
                                  !(b.lanes.count > 1 && !b.lanes.is_uniform()));
  KnownValue result = takes_a ? a : b;
  result.at = is_min ? std::min(a.at, b.at) : std::max(a.at, b.at);
  result.low = is_min ? std::min(a.low, b.low) : std::max(a.low, b.low);
  result.high = is_min ? std::min(a.high, b.high) : std::max(a.high, b.high);
  result.lanes.count = std::max(a.lanes.count, b.lanes.count);
  result.lanes.inner = std::max(a.lanes.inner, b.lanes.inner);
  if (!a_only && !b_only && !result.lanes.is_uniform()) result.lanes.bent = true;
  return result;
}

// How often a < b + limit, whose difference is spread evenly over its range.
KnownValue less_than(const KnownValue& a, const KnownValue& b, double limit) {
  const double low = a.low - b.high, high = a.high - b.low;
  if (high < limit) return condition(1);
  if (low >= limit) return condition(0);
  if (low <= -unbounded / 2 || high >= unbounded / 2) return condition(0.5);
  return condition(std::clamp((limit - low) / std::max(high - low + 1, 1.0), 0.0, 1.0));
}

KnownValue equal_to(const KnownValue& a, const KnownValue& b) {
  if (a.high < b.low || b.high < a.low) return condition(0);
  const double width = std::max(a.high - b.low, b.high - a.low);
  return condition(width <= 0 ? 1 : std::max(1 / (width + 1), 1e-3));
}

KnownValue negated(const KnownValue& a) { return condition(1 - a.at); }

KnownValue binary_value(const Expr& e, const KnownValue& a, const KnownValue& b) {
  switch (e.kind()) {
    case Kind::Add:
      return sum_of(a, b, 1);
    case Kind::Sub:
      return sum_of(a, b, -1);
    case Kind::Mul:
      return product_of(a, b);
    case Kind::Div:
      return quotient_of(a, b, is_integer(e));
    case Kind::Mod:
      return remainder_of(a, b);
    case Kind::Min:
      return extreme_of(a, b, true);
    case Kind::Max:
      return extreme_of(a, b, false);
    case Kind::LT:
      return less_than(a, b, 0);
    case Kind::LE:
      return less_than(a, b, 1);
    case Kind::GT:
      return less_than(b, a, 0);
    case Kind::GE:
      return less_than(b, a, 1);
    case Kind::EQ:
      return equal_to(a, b);
    case Kind::NE:
      return negated(equal_to(a, b));
    case Kind::And:
      return condition(a.at * b.at);
    case Kind::Or:
      return condition(1 - (1 - a.at) * (1 - b.at));
    default:
      return constant(0);
  }
}

KnownValue choice_of(const KnownValue& which, const KnownValue& a, const KnownValue& b) {
  KnownValue result = which.at >= 0.5 ? a : b;
  result.low = std::min(a.low, b.low);
  result.high = std::max(a.high, b.high);
  if (a.number != b.number && !which.lanes.is_uniform()) result.lanes.any = true;
  return result;
}

KnownValue ramp_of(const KnownValue& base, const KnownValue& step, int lanes) {
  KnownValue result = base;
  const double last = step.at * (lanes - 1);
  result.low = bounded(base.low + std::min(0.0, last));
  result.high = bounded(base.high + std::max(0.0, last));
  result.lanes = base.lanes;
  result.lanes.count = base.lanes.count * lanes;
  if (base.lanes.count == 1) {
    result.lanes = Lanes{lanes, lanes, step.at, 0};
  } else {
    result.lanes.any = result.lanes.any || base.lanes.inner != base.lanes.count;
    result.lanes.inner = base.lanes.count;
    result.lanes.outer_step = step.at;
  }
  result.lanes.any = result.lanes.any || step.from_data;
  return result;
}

KnownValue repeated(const KnownValue& value, int times) {
  KnownValue result = value;
  result.lanes.count = value.lanes.count * times;
  result.lanes.inner = value.lanes.count == 1 ? times : value.lanes.count;
  if (value.lanes.count > 1 && value.lanes.inner != value.lanes.count) result.lanes.any = true;
  result.lanes.outer_step = 0;
  return result;
}

// Of any or of all lanes: neighbours mostly agree.
KnownValue reduced(const VectorReduce& n, const KnownValue& value) {
  KnownValue result = condition(n.op == Kind::Or ? std::sqrt(value.at) : value.at * value.at);
  result.depends = value.depends;
  result.from_data = value.from_data;
  return result;
}

KnownValue unknown(Type type) {
  const int lanes = type.lanes();
  if (type.is_bool() && lanes == 1) {
    KnownValue result = condition(0.5);
    result.from_data = true;
    return result;
  }
  KnownValue result;
  if (type.is_bool()) result.at = 0.5;
  result.low = -unbounded;
  result.high = unbounded;
  result.from_data = true;
  result.lanes.count = result.lanes.inner = lanes;
  result.lanes.any = lanes > 1;
  return result;
}

}  // namespace

// ---- loops and names ----

void KnownValues::bind(const std::string& name, KnownValue value) {
  // What was found out with another value of the name does not hold any more.
  if (!bound_.insert_or_assign(name, std::move(value)).second) memo_.clear();
}

void KnownValues::enter(const std::string& loop, const KnownValue& min, double trips,
                        std::unordered_set<std::string> stored) {
  const size_t place = stored_.size();
  stored_.push_back(std::move(stored));
  if (loop.empty()) return;
  KnownValue value = min;
  value.at = min.at + std::floor(std::max(trips - 1, 0.0) / 2);
  value.high = min.high + std::max(trips - 1, 0.0);
  value.slopes.resize(std::max(value.slopes.size(), place + 1));
  value.slopes[place] = 1;
  if (place < 64) value.depends |= uint64_t{1} << place;
  value.number = mix(next_++, 77);
  bind(loop, std::move(value));
}

void KnownValues::leave() { stored_.pop_back(); }

// ---- expressions ----

KnownValue KnownValues::of(const Expr& e) {
  if (const auto found = memo_.find(e.get()); found != memo_.end()) return found->second.second;
  KnownValue result = find_out(e);
  memo_.emplace(e.get(), std::pair(e, result));
  return result;
}

KnownValue KnownValues::variable_value(const Variable& v) {
  if (const auto found = bound_.find(v.name); found != bound_.end()) return found->second;
  KnownValue result = constant(0);
  if (const auto found = sizes_.scalars.find(v.name); found != sizes_.scalars.end())
    result = constant(found->second);
  result.number = number_of(v.name);
  return result;
}

KnownValue KnownValues::load_value(const Load& load) {
  const KnownValue index = of(load.index);
  KnownValue result = unknown(load.type);
  result.lanes.any = !index.lanes.is_uniform() && load.type.lanes() > 1;
  result.depends = index.depends;
  for (size_t i = stored_.size(); i-- > 0;) {
    if (stored_[i].contains(load.name)) {
      result.depends |= uint64_t{1} << std::min<size_t>(i, 63);
      break;
    }
  }
  // After a store to the place the value is another one, but no load: it is in a register.
  result.number = mix(mix(number_of(load.name), index.number), number_of(load.type));
  return result;
}

KnownValue KnownValues::call_value(const Call& call) {
  std::vector<KnownValue> args;
  if (call.is_op(Op::buffer_min, Op::buffer_extent, Op::buffer_stride)) {
    const Variable* buffer = call.args[0].as<Variable>();
    const auto dimension = as_const_int(call.args[1]);
    const std::string name = buffer ? buffer->name.substr(0, buffer->name.rfind('.')) : "";
    const auto found = sizes_.buffers.find(name);
    if (!dimension || found == sizes_.buffers.end() ||
        static_cast<size_t>(*dimension) >= found->second.dims.size())
      return constant(call.is_op(Op::buffer_min) ? 0 : 1);
    const BufferShape::Dim& dim = found->second.dims[static_cast<size_t>(*dimension)];
    return constant(static_cast<double>(call.is_op(Op::buffer_min)      ? dim.min
                                        : call.is_op(Op::buffer_extent) ? dim.extent
                                                                        : dim.stride));
  }
  if (call.is_op(Op::buffer_is_null, Op::buffer_is_query)) return condition(0);
  for (const Expr& arg : call.args) args.push_back(of(arg));
  if (call.is_op(Op::runtime_call)) return constant(0);
  if (call.is_op(Op::is_nan)) return condition(0);
  KnownValue result = unknown(call.type);
  if (call.is_op(Op::if_then_else))
    result = choice_of(args[0], args[1], args[2]);
  else if (call.call_type == CallType::Operator && passed_operand(call.op) >= 0)
    result = args[static_cast<size_t>(passed_operand(call.op))];
  else if (call.is_op(Op::floor, Op::ceil, Op::round, Op::trunc) && !args.empty())
    result = args[0];
  else if (call.type.is_bool())
    result = condition(0.1);
  const bool known = !args.empty() && !result.from_data;
  for (const KnownValue& arg : args) depend_on(result, arg);
  if (known && call.is_likely()) result.from_data = args[0].from_data;
  return result;
}

KnownValue KnownValues::let_value(const Let& let) {
  bind(let.name, of(let.value));
  return of(let.body);
}

KnownValue KnownValues::find_out(const Expr& e) {
  uint64_t number = mix(static_cast<uint64_t>(e.kind()) + 1, number_of(e.type()));
  const auto numbered = [&](KnownValue value) {
    value.number = number;
    return value;
  };
  const auto operand = [&](const Expr& child) {
    KnownValue value = of(child);
    number = mix(number, value.number);
    return value;
  };
  return match(
      e,
      [&](const IntImm& n) {
        return number = mix(number, static_cast<uint64_t>(n.value)),
               numbered(constant(static_cast<double>(n.value)));
      },
      [&](const UIntImm& n) {
        number = mix(number, n.value);
        return numbered(n.type.is_bool() ? condition(n.value ? 1 : 0)
                                         : constant(static_cast<double>(n.value)));
      },
      [&](const FloatImm& n) {
        number = mix(number, std::bit_cast<uint64_t>(n.value));
        return numbered(constant(bounded(n.value)));
      },
      [&](const Variable& n) { return variable_value(n); },
      [&](const Load& n) { return load_value(n); }, [&](const Let& n) { return let_value(n); },
      [&](const Call& n) {
        KnownValue result = call_value(n);
        number = mix(number, number_of(n.name));
        for (const Expr& arg : n.args) operand(arg);
        return numbered(std::move(result));
      },
      [&](const Binary& n) {
        const KnownValue a = operand(n.a), b = operand(n.b);
        KnownValue result = binary_value(e, a, b);
        depend_on(result, a);
        depend_on(result, b);
        result.lanes.count = e.type().lanes();
        if (e.type().is_bool()) result.lanes = any_lanes(a.lanes, b.lanes);
        return numbered(std::move(result));
      },
      [&](const Select& n) {
        const KnownValue which = operand(n.condition), a = operand(n.when_true),
                         b = operand(n.when_false);
        KnownValue result = choice_of(which, a, b);
        for (const KnownValue* part : {&which, &a, &b}) depend_on(result, *part);
        return numbered(std::move(result));
      },
      [&](const Ramp& n) {
        const KnownValue base = operand(n.base), step = operand(n.stride);
        KnownValue result = ramp_of(base, step, n.lanes);
        depend_on(result, step);
        return numbered(std::move(result));
      },
      [&](const Broadcast& n) { return numbered(repeated(operand(n.value), n.lanes)); },
      [&](const Cast& n) { return numbered(operand(n.value)); },
      [&](const Not& n) {
        KnownValue value = operand(n.a), result = negated(value);
        depend_on(result, value);
        result.lanes = value.lanes;
        return numbered(std::move(result));
      },
      [&](const VectorReduce& n) {
        const KnownValue value = operand(n.value);
        if (n.type.is_bool() && n.type.lanes() == 1) return numbered(reduced(n, value));
        KnownValue result = unknown(n.type);
        depend_on(result, value);
        number = mix(number, static_cast<uint64_t>(n.op));
        return numbered(std::move(result));
      },
      [&](const ExprNode& n) {
        KnownValue result = unknown(n.type);
        for_each_child(e, [&](const Expr& child) { depend_on(result, operand(child)); });
        if (const Shuffle* shuffle = e.as<Shuffle>())
          for (const int i : shuffle->indices) number = mix(number, static_cast<uint64_t>(i));
        return numbered(std::move(result));
      });
}

}  // namespace retrograde::tuning
