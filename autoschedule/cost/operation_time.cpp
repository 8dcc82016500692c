// The cost of an operation on one core.
#include <algorithm>
#include <map>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/stage_facts.h"
#include "ir/operators.h"

namespace retrograde::planning {

namespace {

// In operations of a vector.
double function_operations_ns(Op op, Type type, const Machine& m) {
  const OpInfo& info = op_info(op);
  const bool is_double = type.bits() == 64;
  const double wide = is_double ? 2 : 1;  // more terms, too
  switch (op) {
    case Op::sqrt:
      return is_double ? m.sqrt_double_ns : m.sqrt_ns;
    case Op::exp:
      return wide * m.exp_ns;
    case Op::log:
      return wide * m.log_ns;
    case Op::pow:
      return wide * m.pow_ns;
    case Op::sin:
    case Op::cos:
      return wide * m.sin_ns;
    default:
      break;
  }
  const double adds = info.work.function_adds;
  if (exact_form(op) != op || op == Op::fast_inverse || op == Op::fast_inverse_sqrt)
    return wide * adds * m.operation_ns;
  return wide * m.exp_ns * adds / op_info(Op::exp).work.function_adds;
}

double call_ns(const std::string& name, Type type, const Machine& m) {
  const Op op = op_from_name(name);
  if (op == Op::none) return function_call_operations * m.scalar_ns;
  const Work& work = op_info(op).work;
  if (work.functions > 0) return function_operations_ns(op, type, m);
  return std::max(1, work.adds + work.mults) * m.operation_ns;
}

// Integers are divided by constants, mostly: by a product and shifts.
double division_ns(const std::string& name, Type type, const Machine& m) {
  const double whole = name == "Mod" ? 2 : 0;  // a product and a difference
  if (!type.is_float()) return (3 + whole) * m.operation_ns;
  return (type.bits() == 64 ? m.divide_double_ns : m.divide_ns) + whole * m.operation_ns;
}

}  // namespace

OperationTime operation_time(const std::string& name, Type type, const Machine& m) {
  static const std::map<std::string, double> operations{
      {"Add", 1}, {"Sub", 1},   {"Mul", 1},  {"Min", 1},    {"Max", 1},        {"EQ", 1},
      {"NE", 1},  {"LT", 1},    {"LE", 1},   {"GT", 1},     {"GE", 1},         {"And", 1},
      {"Or", 1},  {"Not", 0.5}, {"Cast", 1}, {"Select", 1}, {"Reinterpret", 0}};
  const double* count = ir::find_or_null(operations, name);
  OperationTime time;
  if (name == "Div" || name == "Mod") {
    time.vector_ns = division_ns(name, type, m);
  } else if (count) {
    // The products of vectors of wide integers are sums of narrower ones.
    const bool is_wide = name == "Mul" && !type.is_float() && type.bits() >= 32;
    time.vector_ns = (is_wide ? type.bits() / 32 + 1 : *count) * m.operation_ns;
    if (name == "Cast") time.vector_ns += m.shuffle_ns / 2;
  } else {
    time.vector_ns = call_ns(name, type, m);
  }
  time.is_integer = !type.is_float() && !type.is_bool();
  const double scale = name == "Mul" || name == "Cast" ? m.operation_ns : time.vector_ns;
  time.scalar_ns = time.is_integer || count ? scale / m.operation_ns * m.scalar_ns : time.vector_ns;
  return time;
}

}  // namespace retrograde::planning
