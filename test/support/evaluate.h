// The value of an expression, lane by lane, by scalar.h. Loads and calls give made-up values that
// depend on their indices alone.
#pragma once

#include <cmath>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/build.h"
#include "ir/expr.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::test {

using Lanes = std::vector<ir::Scalar>;

class Evaluator {
 public:
  explicit Evaluator(std::map<std::string, ir::Scalar> variables)
      : variables_(std::move(variables)) {}

  const Lanes& operator()(const Expr& e) {
    auto found = memo_.find(e.get());
    if (found == memo_.end()) {
      found = memo_.emplace(e.get(), std::pair(e, node(e))).first;
      for (const ir::Scalar& s : found->second.second) {
        if (!s.type.is_int() || s.type.bits() < 32) continue;
        met_extreme_ |= s.i > s.type.max_int() / 2 || s.i < s.type.min_int() / 2;
      }
    }
    return found->second.second;
  }
  // Whether an operation on int32 or int64 left its type's range: then the language promises
  // nothing.
  bool overflowed() const { return overflowed_; }
  // Whether an int32 or int64 beyond half of its type's range occurred.
  bool met_extreme() const { return met_extreme_; }

 private:
  Lanes node(const Expr& e) {
    using namespace ir;
    return match(
        e,
        [&](const Variable& n) {
          const auto found = variables_.find(n.name);
          if (found == variables_.end()) throw std::runtime_error("no value for " + n.name);
          return Lanes{found->second};
        },
        [&](const Cast& n) {
          return map(n.value, [&](const Scalar& s) { return eval_cast(n.type.element_of(), s); });
        },
        [&](const Reinterpret& n) {
          return map(n.value,
                     [&](const Scalar& s) { return eval_reinterpret(n.type.element_of(), s); });
        },
        [&](const Binary& n) { return binary(n); },
        [&](const Not& n) { return map(n.a, [](const Scalar& s) { return eval_not(s); }); },
        [&](const Select& n) {
          const Lanes c = (*this)(n.condition), t = (*this)(n.true_value),
                      f = (*this)(n.false_value);
          Lanes result;
          for (size_t i = 0; i < t.size(); ++i)
            result.push_back(c[c.size() == 1 ? 0 : i].as_bool() ? t[i] : f[i]);
          return result;
        },
        [&](const Load& n) {
          return map(n.index,
                     [&](const Scalar& s) { return made_up(n.type, static_cast<uint64_t>(s.i)); });
        },
        [&](const Ramp& n) { return ramp(n); },
        [&](const Broadcast& n) {
          const Lanes value = (*this)(n.value);
          Lanes result;
          for (int i = 0; i < n.lanes; ++i) result.insert(result.end(), value.begin(), value.end());
          return result;
        },
        [&](const Call& n) { return call(n); },
        [&](const Let& n) {
          variables_[n.name] = (*this)(n.value)[0];
          return (*this)(n.body);
        },
        [&](const Shuffle& n) {
          Lanes all, result;
          for (const Expr& v : n.vectors) {
            const Lanes& lanes = (*this)(v);
            all.insert(all.end(), lanes.begin(), lanes.end());
          }
          for (int index : n.indices) result.push_back(all[static_cast<size_t>(index)]);
          return result;
        },
        [&](const VectorReduce& n) { return reduce(n); },
        [&](const ExprNode&) { return Lanes{*as_scalar(e)}; });
  }

  template <class F>
  Lanes map(const Expr& e, F f) {
    Lanes result;
    for (const ir::Scalar& s : Lanes((*this)(e))) result.push_back(f(s));
    return result;
  }

  ir::Scalar operate(ir::Kind kind, const ir::Scalar& a, const ir::Scalar& b) {
    using ir::Kind;
    if (a.type.is_int() && a.type.bits() >= 32) {
      const __int128 x = a.i, y = b.i;
      const __int128 exact = kind == Kind::Add   ? x + y
                             : kind == Kind::Sub ? x - y
                             : kind == Kind::Mul ? x * y
                                                 : 0;
      if (exact < a.type.min_int() || exact > a.type.max_int()) overflowed_ = true;
      if (kind == Kind::Div && x == a.type.min_int() && y == -1) overflowed_ = true;
    }
    return ir::eval_binary(kind, a, b);
  }

  Lanes binary(const ir::Binary& n) {
    const Lanes a = (*this)(n.a), b = (*this)(n.b);
    Lanes result;
    for (size_t i = 0; i < a.size(); ++i) result.push_back(operate(n.kind, a[i], b[i]));
    return result;
  }

  Lanes ramp(const ir::Ramp& n) {
    const Lanes base = (*this)(n.base), stride = (*this)(n.stride);
    Lanes result;
    for (int i = 0; i < n.lanes; ++i) {
      for (size_t j = 0; j < base.size(); ++j) {
        const ir::Scalar step =
            operate(ir::Kind::Mul, stride[j], ir::Scalar::of_int(stride[j].type, i));
        result.push_back(operate(ir::Kind::Add, base[j], step));
      }
    }
    return result;
  }

  Lanes reduce(const ir::VectorReduce& n) {
    using ir::Kind, ir::ReduceOp;
    static const std::map<ReduceOp, Kind> kinds = {
        {ReduceOp::Add, Kind::Add}, {ReduceOp::Mul, Kind::Mul}, {ReduceOp::Min, Kind::Min},
        {ReduceOp::Max, Kind::Max}, {ReduceOp::And, Kind::And}, {ReduceOp::Or, Kind::Or}};
    const Lanes value = (*this)(n.value);
    const size_t lanes = static_cast<size_t>(n.type.lanes()), group = value.size() / lanes;
    Lanes result;
    for (size_t i = 0; i < lanes; ++i) {
      ir::Scalar sum = value[i * group];
      for (size_t j = 1; j < group; ++j) sum = operate(kinds.at(n.op), sum, value[i * group + j]);
      result.push_back(sum);
    }
    return result;
  }

  Lanes call(const ir::Call& n) {
    std::vector<Lanes> args;
    for (const Expr& arg : n.args) args.push_back((*this)(arg));
    Lanes result;
    for (int i = 0; i < n.type.lanes(); ++i) {
      std::vector<ir::Scalar> lane;
      uint64_t key = 1;
      for (const Lanes& arg : args) {
        lane.push_back(arg[arg.size() == 1 ? 0 : static_cast<size_t>(i)]);
        key = key * 1000003 + static_cast<uint64_t>(lane.back().i);
      }
      if (n.call_type == ir::CallType::Operator) {
        result.push_back(*ir::eval_operator(n.op, lane, n.type.element_of()));
      } else {
        result.push_back(made_up(n.type, key));
      }
    }
    return result;
  }

  static ir::Scalar made_up(Type type, uint64_t key) {
    key = (key + 77) * 0x9e3779b97f4a7c15ull;
    key ^= key >> 29;
    if (type.is_float())
      return ir::Scalar::of_float(type, static_cast<double>(key % 1000) / 8 - 50);
    return ir::Scalar::of_int(type, static_cast<int64_t>(key % 1000) - (type.is_int() ? 500 : 0));
  }

  std::map<std::string, ir::Scalar> variables_;
  std::unordered_map<const ir::ExprNode*, std::pair<Expr, Lanes>> memo_;
  bool overflowed_ = false, met_extreme_ = false;
};

// Bit for bit, except that one NaN is as good as another.
inline bool same_value(const ir::Scalar& a, const ir::Scalar& b) {
  if (a.type != b.type) return false;
  if (!a.type.is_float()) return a.u == b.u;
  return std::isnan(a.f) ? std::isnan(b.f) : a.u == b.u;
}

}  // namespace retrograde::test
