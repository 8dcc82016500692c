#include "testing/interpreter/expressions.h"

#include "diagnostics/error.h"
#include "ir/print.h"
#include "ir/random.h"
#include "ir/visit.h"

namespace retrograde::oracle {

using namespace graph;

namespace {

Value steady(const Value& value, bool stable) {
  return stable || value.is_undef() ? value : Value::unstable(value.scalar);
}

}  // namespace

const Value& Expressions::get(Frame& frame, const Expr& e) {
  Frame::Slot& slot = frame.slots[e.get()];
  if (slot.epoch != frame.epoch) {
    slot.value = evaluate(frame, e);
    slot.epoch = frame.epoch;
  }
  return slot.value;
}

std::vector<Value> Expressions::all_of(Frame& frame, const std::vector<Expr>& exprs) {
  return ir::mapped(exprs, [&](const Expr& e) { return get(frame, e); });
}

Point Expressions::coordinates(Frame& frame, const std::vector<Expr>& args, bool& stable) {
  Point point;
  for (const Expr& arg : args) {
    const Value& coordinate = get(frame, arg);
    stable &= coordinate.is_stable();
    point.push_back(static_cast<int>(coordinate.scalar.i));
  }
  return point;
}

Value Expressions::evaluate(Frame& frame, const Expr& e) {
  check_work();
  return match(
      e, [&](const Variable& n) { return variable(frame, e, n); },
      [&](const Cast& n) {
        ++operations_;
        return apply_cast(options_.rounding, widened(n.type), get(frame, n.value));
      },
      [&](const Reinterpret& n) { return reinterpret(frame, n); },
      [&](const Binary& n) { return binary(frame, n); },
      [&](const Not& n) {
        ++operations_;
        return apply_not(get(frame, n.a));
      },
      [&](const Select& n) { return select(frame, n.condition, n.when_true, n.when_false); },
      [&](const Call& n) { return call(frame, n); }, [&](const ExprNode&) { return constant(e); });
}

void Expressions::check_work() const {
  if (operations_ > options_.max_operations) {
    call_error("interpret the program", "a run has a bounded number of operations",
               text("more than ", options_.max_operations),
               "Raise InterpreterOptions::max_operations.");
  }
}

Value Expressions::constant(const Expr& e) const {
  const auto scalar = e.type().is_scalar() ? as_scalar(e) : std::nullopt;
  if (!scalar) internal_error("not part of an algorithm: " + ir::print(e));
  Value result{*scalar};
  result.scalar.type = widened(e.type());
  return result;
}

Value Expressions::variable(const Frame& frame, const Expr& e, const Variable& n) const {
  const auto place = frame.places.find(n.name);
  if (place != frame.places.end()) return {Scalar::of_int(Int(32), frame.point[place->second])};
  const auto* parameter = dynamic_cast<const ParameterContents*>(n.symbol.raw());
  if (!parameter) internal_error("unbound variable " + quoted(n.name));
  if (parameter->is_buffer) return Inputs::metadata(*parameter, n);
  return apply_cast(Rounding::Strict, widened(e.type()), Inputs::value_of(*parameter));
}

// Short-circuit evaluation: if one operand of && or || decides, the other is not evaluated.
Value Expressions::binary(Frame& frame, const Binary& n) {
  ++operations_;
  const Value& a = get(frame, n.a);
  if ((n.kind == Kind::And || n.kind == Kind::Or) && !a.is_undef()) {
    const bool deciding = n.kind == Kind::Or;
    if (a.is_stable() && a.scalar.as_bool() == deciding) return a;
    const Value& b = get(frame, n.b);
    if (!b.is_undef() && b.is_stable() && b.scalar.as_bool() == deciding) return b;
  }
  return apply_binary(options_.rounding, n.kind, a, get(frame, n.b));
}

Value Expressions::select(Frame& frame, const Expr& condition, const Expr& if_true,
                          const Expr& if_false) {
  ++operations_;
  const Value& decision = get(frame, condition);
  if (decision.is_undef()) return decision;
  return steady(get(frame, decision.scalar.as_bool() ? if_true : if_false), decision.is_stable());
}

Value Expressions::reinterpret(Frame& frame, const Reinterpret& n) {
  ++operations_;
  const Value exact = apply_cast(options_.rounding, n.value.type(), get(frame, n.value));
  return apply_cast(options_.rounding, widened(n.type), apply_reinterpret(n.type, exact));
}

// ---- calls ----

Value Expressions::call(Frame& frame, const Call& n) {
  switch (n.call_type) {
    case CallType::Func:
      return func_call(frame, n);
    case CallType::Image:
      return image_call(frame, n);
    case CallType::Extern:
      unsupported("interpret a call of " + quoted(n.name),
                  "a value is computed by operators, not by C functions");
    case CallType::Operator:
      break;
  }
  return operator_call(frame, n);
}

Value Expressions::func_call(Frame& frame, const Call& n) {
  bool stable = true;
  const Point point = coordinates(frame, n.args, stable);
  const auto& callee = *static_cast<const FuncContents*>(n.symbol.raw());
  return steady(funcs_.read(callee, point, n.component), stable);
}

Value Expressions::image_call(Frame& frame, const Call& n) {
  bool stable = true;
  const Point point = coordinates(frame, n.args, stable);
  const Value element = inputs_.read(*static_cast<const ParameterContents*>(n.symbol.raw()), point);
  return steady(apply_cast(Rounding::Strict, widened(n.type), element), stable);
}

Value Expressions::operator_call(Frame& frame, const Call& n) {
  switch (n.op) {
    case Op::undef:
      return Value::undef();
    case Op::random:
      return random(frame, n);
    case Op::require:
      return require(frame, n);
    case Op::if_then_else:
      return select(frame, n.args[0], n.args[1], n.args[2]);
    case Op::print:
    case Op::print_when:
      return get(frame, n.args[n.op == Op::print ? 0 : 1]);
    default:
      ++operations_;
      return apply_operator(options_.rounding, n.op, all_of(frame, n.args), widened(n.type));
  }
}

Value Expressions::random(Frame& frame, const Call& n) {
  std::vector<uint32_t> words;
  bool stable = true;
  for (const Value& word : all_of(frame, n.args)) {
    words.push_back(static_cast<uint32_t>(word.scalar.u));
    stable &= word.is_stable();
  }
  const uint32_t bits = random_bits(words.data(), static_cast<int>(words.size()));
  const Scalar number = n.type.is_float() ? Scalar::of_float(n.type, random_float(bits))
                                          : Scalar::of_uint(UInt(32), bits);
  return steady(apply_cast(Rounding::Strict, widened(n.type), {number}), stable);
}

Value Expressions::require(Frame& frame, const Call& n) {
  if (get(frame, n.args[0]).scalar.as_bool()) return get(frame, n.args[1]);
  std::string message;
  for (size_t i = 2; i < n.args.size(); ++i) {
    const auto* words = n.args[i].as<StringImm>();
    message += text(message.empty() ? "" : " ",
                    words ? words->value : text(get(frame, n.args[i]).scalar.as_double()));
  }
  call_error("interpret", "the condition of a require holds", message);
}

}  // namespace retrograde::oracle
