// Random well-typed expressions and statements, the same for the same seed on every machine.
#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "ir/build.h"
#include "ir/expr.h"

namespace retrograde::test {

class RandomIr {
 public:
  explicit RandomIr(uint32_t seed) : random_(seed) {}

  int below(int n) { return static_cast<int>(random_() % static_cast<uint32_t>(n)); }
  bool chance(int percent) { return below(100) < percent; }
  template <class T>
  T pick(const std::vector<T>& choices) {
    return choices[static_cast<size_t>(below(static_cast<int>(choices.size())))];
  }

  Type scalar_type() {
    return pick<Type>({Int(32), Int(32), Int(32), Int(64), Int(8), Int(16), UInt(8), UInt(16),
                       UInt(32), UInt(64), Bool(), Float(32), Float(32), Float(64), Float(16),
                       BFloat(16)});
  }

  // Mostly small constants, sometimes an extreme one.
  Expr constant(Type type) {
    if (type.is_bool()) return ir::make_const(type, int64_t{below(2)});
    if (type.is_float()) {
      static const double special[] = {0.0,   -0.0, 1.0,      -1.0,      0.5, 2.0,
                                       1e-40, 1e30, INFINITY, -INFINITY, NAN};
      return ir::make_const(type, chance(40) ? special[below(11)] : (below(2001) - 1000) / 8.0);
    }
    if (chance(3))
      return ir::make_const(type, type.is_int() && chance(50) ? type.min_int() : type.max_int());
    return ir::make_const(type, int64_t{below(20) - (type.is_int() ? 6 : 0)});
  }

  Expr variable(Type type) {
    const std::string prefix = to_string(type.element_of());
    if (type.element_of() == Int(32))
      return spread(ir::variable(pick<std::string>({"x", "y", "z"})), type);
    return spread(ir::variable(prefix + "_" + pick<std::string>({"a", "b"}), type.element_of()),
                  type);
  }

  Expr expr(Type type, int depth) {
    if (depth <= 0) return chance(40) ? constant(type) : variable(type);
    if (chance(8)) return shared(type, depth);
    if (type.is_vector() && chance(40)) return vector(type, depth);
    if (type.is_bool()) return condition(type, depth);
    Expr result = chance(75) ? arithmetic(type, depth) : other(type, depth);
    recent_.push_back(result);
    return result;
  }

 private:
  Expr spread(Expr scalar, Type type) {
    return ir::make_broadcast(std::move(scalar), type.lanes());
  }

  // A node that was generated before, because expressions are DAGs.
  Expr shared(Type type, int depth) {
    for (int tries = 0; tries < 5 && !recent_.empty(); ++tries) {
      Expr candidate = pick(recent_);
      if (candidate.type() == type) return candidate;
    }
    return expr(type, depth - 1);
  }

  Expr arithmetic(Type type, int depth) {
    using ir::Kind;
    const Kind kind = pick<Kind>({Kind::Add, Kind::Add, Kind::Sub, Kind::Sub, Kind::Mul, Kind::Div,
                                  Kind::Mod, Kind::Min, Kind::Max});
    Expr a = expr(type, depth - 1);
    const bool prefers_constant = kind == Kind::Mul || kind == Kind::Div || kind == Kind::Mod;
    Expr b = prefers_constant && chance(80) ? constant(type) : expr(type, depth - 1);
    return ir::binary(kind, std::move(a), std::move(b));
  }

  Expr condition(Type type, int depth) {
    using ir::Kind;
    const int choice = below(10);
    if (choice < 2) return ir::logical_not(expr(type, depth - 1));
    if (choice < 4)
      return ir::binary(chance(50) ? Kind::And : Kind::Or, expr(type, depth - 1),
                        expr(type, depth - 1));
    const Type operands =
        pick<Type>({Int(32), Int(32), Int(32), scalar_type()}).with_lanes(type.lanes());
    const Kind kind = pick<Kind>({Kind::EQ, Kind::NE, Kind::LT, Kind::LE, Kind::GT, Kind::GE});
    return ir::binary(kind, expr(operands, depth - 1), expr(operands, depth - 1));
  }

  Expr other(Type type, int depth) {
    switch (below(7)) {
      case 0:
        return ir::make_select(expr(Bool(chance(50) ? type.lanes() : 1), depth - 1),
                               expr(type, depth - 1), expr(type, depth - 1));
      case 1: {  // a float that does not fit an integer becomes anything: not generated
        Type from = scalar_type().with_lanes(type.lanes());
        if (from.is_float() && !type.is_float()) from = Int(16, type.lanes());
        return ir::cast_to(type, expr(from, depth - 1));
      }
      case 2: {
        const std::string name = "let" + std::to_string(++lets_);
        Expr value = expr(Int(32), depth - 1);
        Expr body = expr(type, depth - 1);
        return ir::make_let(name, value,
                            ir::binary(ir::Kind::Add, body, ir::cast_to(type, ir::variable(name))));
      }
      case 3:
        return ir::make_load(type, "buffer", expr(Int(32, type.lanes()), depth - 1));
      case 4:
        return ir::call_image("image", type, {expr(Int(32), depth - 1), expr(Int(32), depth - 1)},
                              {});
      case 5:
        return ir::likely(expr(type, depth - 1));
      default:
        return operator_call(type, depth);
    }
  }

  Expr operator_call(Type type, int depth) {
    using ir::Op;
    const auto arg = [&] { return expr(type, depth - 1); };
    if (type.is_float()) {
      if (chance(30))
        return ir::call_op(pick<Op>({Op::strong_mul, Op::strong_div}), {arg(), arg()});
      return ir::call_op(pick<Op>({Op::floor, Op::abs, Op::sqrt, Op::trunc, Op::round}), {arg()});
    }
    if (chance(30))
      return ir::call_op(pick<Op>({Op::popcount, Op::count_leading_zeros, Op::bitwise_not}),
                         {arg()});
    return ir::call_op(pick<Op>({Op::bitwise_and, Op::bitwise_or, Op::bitwise_xor, Op::shift_left,
                                 Op::shift_right}),
                       {arg(), arg()});
  }

  Expr vector(Type type, int depth) {
    const Type scalar = type.element_of();
    const int choice = below(6);
    if (choice < 2) return ir::make_broadcast(expr(scalar, depth - 1), type.lanes());
    if (choice < 4 && scalar.is_int_or_uint() && !scalar.is_bool()) {
      return ir::make_ramp(expr(scalar, depth - 1), chance(80) ? constant(scalar) : expr(scalar, 1),
                           type.lanes());
    }
    if (choice == 4) {
      std::vector<int> lanes;
      for (int i = 0; i < type.lanes(); ++i) lanes.push_back(below(2 * type.lanes()));
      return ir::make_shuffle({expr(type, depth - 1), expr(type, depth - 1)}, lanes);
    }
    if (scalar.is_bool() || scalar.is_float()) return expr(type, depth - 1);
    const auto op = pick<ir::Kind>({ir::Kind::Add, ir::Kind::Min, ir::Kind::Max});
    return ir::make_vector_reduce(op, expr(type.with_lanes(2 * type.lanes()), depth - 1),
                                  type.lanes());
  }

  std::mt19937 random_;
  std::vector<Expr> recent_;
  int lets_ = 0;
};

}  // namespace retrograde::test
