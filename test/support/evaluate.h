// Evaluates an expression lane by lane, with the scalar operations of scalar.h. Classes derived from LaneEvaluator
// define loads and calls.
#pragma once

#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "ir/build.h"
#include "ir/expr.h"
#include "ir/print.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::test {

using Lanes = std::vector<ir::Scalar>;

class LaneEvaluator {
 public:
  virtual ~LaneEvaluator() = default;
  virtual Lanes eval(const Expr& e) { return value(e); }

 protected:
  virtual Lanes load(const ir::Load& n) = 0;
  // The value of one lane of a call to a function that is not an operator.
  virtual ir::Scalar other_call(const ir::Call& n, const Lanes& args) = 0;
  virtual ir::Scalar operate(ir::Kind kind, const ir::Scalar& a, const ir::Scalar& b) {
    return ir::eval_binary(kind, a, b);
  }
  virtual Lanes call(const ir::Call& n) {
    std::vector<Lanes> args;
    for (const Expr& arg : n.args) args.push_back(eval(arg));
    Lanes result, lane;
    for (size_t i = 0; i < static_cast<size_t>(n.type.lanes()); ++i) {
      lane.clear();
      for (const Lanes& arg : args) lane.push_back(arg[arg.size() == 1 ? 0 : i]);
      result.push_back(n.call_type == ir::CallType::Operator ? operator_of(n, lane)
                                                             : other_call(n, lane));
    }
    return result;
  }

  std::map<std::string, Lanes> variables_;

  Lanes value(const Expr& e) {
    using namespace ir;
    if (const auto constant = as_scalar(e))
      return Lanes(static_cast<size_t>(e.type().lanes()), *constant);
    return match(
        e, [&](const Variable& n) { return variable(n.name); },
        [&](const Cast& n) {
          return map(eval(n.value),
                     [&](const Scalar& s) { return eval_cast(n.type.element_of(), s); });
        },
        [&](const Reinterpret& n) {
          return map(eval(n.value),
                     [&](const Scalar& s) { return eval_reinterpret(n.type.element_of(), s); });
        },
        [&](const Binary& n) { return binary(n); },
        [&](const Not& n) { return map(eval(n.a), [](const Scalar& s) { return eval_not(s); }); },
        [&](const Select& n) { return select(n); }, [&](const Load& n) { return load(n); },
        [&](const Ramp& n) { return ramp(n); },
        [&](const Broadcast& n) {
          return joined(std::vector<Lanes>(static_cast<size_t>(n.lanes), eval(n.value)));
        },
        [&](const Call& n) { return call(n); },
        [&](const Let& n) {
          variables_[n.name] = eval(n.value);
          return eval(n.body);
        },
        [&](const Shuffle& n) { return shuffle(n); },
        [&](const VectorReduce& n) { return reduce(n); },
        [&](const ExprNode&) -> Lanes {
          throw std::runtime_error("expression not evaluated: " + ir::print(e));
        });
  }

 private:
  template <class F>
  static Lanes map(Lanes lanes, F f) {
    for (ir::Scalar& lane : lanes) lane = f(lane);
    return lanes;
  }
  static Lanes joined(const std::vector<Lanes>& parts) {
    Lanes all;
    for (const Lanes& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
  }

  Lanes variable(const std::string& name) {
    const auto found = variables_.find(name);
    if (found == variables_.end()) throw std::runtime_error("no value for " + name);
    return found->second;
  }

  static ir::Scalar operator_of(const ir::Call& n, const Lanes& args) {
    const auto result = ir::eval_operator(n.op, args, n.type.element_of());
    if (!result)
      throw std::runtime_error(std::string("operator not evaluated: ") + ir::op_info(n.op).name);
    return *result;
  }

  Lanes select(const ir::Select& n) {
    const Lanes c = eval(n.condition), t = eval(n.when_true), f = eval(n.when_false);
    Lanes result;
    for (size_t i = 0; i < t.size(); ++i)
      result.push_back(c[c.size() == 1 ? 0 : i].as_bool() ? t[i] : f[i]);
    return result;
  }

  Lanes shuffle(const ir::Shuffle& n) {
    std::vector<Lanes> parts;
    for (const Expr& v : n.vectors) parts.push_back(eval(v));
    const Lanes all = joined(parts);
    Lanes result;
    for (int index : n.indices) result.push_back(all[static_cast<size_t>(index)]);
    return result;
  }

  Lanes binary(const ir::Binary& n) {
    Lanes a = eval(n.a);
    const Lanes b = eval(n.b);
    for (size_t i = 0; i < a.size(); ++i) a[i] = operate(n.kind, a[i], b[i]);
    return a;
  }

  Lanes ramp(const ir::Ramp& n) {
    const Lanes base = eval(n.base), stride = eval(n.stride);
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
    const Lanes value = eval(n.value);
    const size_t lanes = static_cast<size_t>(n.type.lanes()), group = value.size() / lanes;
    Lanes result;
    for (size_t i = 0; i < lanes; ++i) {
      ir::Scalar sum = value[i * group];
      for (size_t j = 1; j < group; ++j) sum = operate(n.op, sum, value[i * group + j]);
      result.push_back(sum);
    }
    return result;
  }
};

// The value of a pure expression. Loads and calls return arbitrary values that depend on their indices alone.
class Evaluator : public LaneEvaluator {
 public:
  explicit Evaluator(const std::map<std::string, ir::Scalar>& variables) {
    for (const auto& [name, value] : variables) variables_[name] = {value};
  }

  const Lanes& operator()(const Expr& e) {
    auto found = memo_.find(e.get());
    if (found == memo_.end()) {
      found = memo_.emplace(e.get(), std::pair(e, value(e))).first;
      for (const ir::Scalar& s : found->second.second) {
        if (!s.type.is_int() || s.type.bits() < 32) continue;
        met_extreme_ |= s.i > s.type.max_int() / 2 || s.i < s.type.min_int() / 2;
      }
    }
    return found->second.second;
  }
  // Whether an operation on int32 or int64 overflowed, in which case the language defines no result.
  bool overflowed() const { return overflowed_; }
  // Whether an int32 or int64 beyond half of its type's range occurred.
  bool met_extreme() const { return met_extreme_; }

 private:
  Lanes eval(const Expr& e) override { return (*this)(e); }

  Lanes load(const ir::Load& n) override {
    Lanes result;
    for (const ir::Scalar& s : eval(n.index))
      result.push_back(made_up(n.type, static_cast<uint64_t>(s.i)));
    return result;
  }

  ir::Scalar other_call(const ir::Call& n, const Lanes& args) override {
    uint64_t key = 1;
    for (const ir::Scalar& arg : args) key = key * 1000003 + static_cast<uint64_t>(arg.i);
    return made_up(n.type, key);
  }

  ir::Scalar operate(ir::Kind kind, const ir::Scalar& a, const ir::Scalar& b) override {
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
    return LaneEvaluator::operate(kind, a, b);
  }

  static ir::Scalar made_up(Type type, uint64_t key) {
    key = (key + 77) * 0x9e3779b97f4a7c15ull;
    key ^= key >> 29;
    if (type.is_float())
      return ir::Scalar::of_float(type, static_cast<double>(key % 1000) / 8 - 50);
    return ir::Scalar::of_int(type, static_cast<int64_t>(key % 1000) - (type.is_int() ? 500 : 0));
  }

  std::unordered_map<const ir::ExprNode*, std::pair<Expr, Lanes>> memo_;
  bool overflowed_ = false, met_extreme_ = false;
};

// Compares bit by bit, except that all NaNs are equal.
inline bool same_value(const ir::Scalar& a, const ir::Scalar& b) {
  if (a.type != b.type) return false;
  if (!a.type.is_float()) return a.u == b.u;
  return std::isnan(a.f) ? std::isnan(b.f) : a.u == b.u;
}

}  // namespace retrograde::test
