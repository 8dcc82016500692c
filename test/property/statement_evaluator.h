// Runs a flat statement on small buffers, lane by lane, with the meaning of ir/scalar.h: what
// passes must preserve. Reading or writing outside of a buffer, or of one that is freed, is an
// error (an exception with the access in it).
#pragma once

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::ir {

class StatementEvaluator {
 public:
  using Value = std::vector<Scalar>;  // one per lane
  std::map<std::string, std::vector<Scalar>> buffers;
  std::vector<int64_t> printed;

  void set(const std::string& name, int64_t value) {
    variables_[name] = {Scalar::of_int(Int(32), value)};
  }

  void run(const Stmt& s) {
    if (!s.defined()) return;
    match(
        s,
        [&](const LetStmt& n) {
          variables_[n.name] = eval(n.value);
          run(n.body);
        },
        [&](const For& n) { run_loop(n); }, [&](const Store& n) { run_store(n); },
        [&](const Allocate& n) {
          buffers[n.name].assign(std::max<int64_t>(0, eval(n.elements)[0].i), poison(n.type));
          run(n.body);
          buffers.erase(n.name);
        },
        [&](const Free& n) {
          if (!buffers.count(n.name)) fail("free", n.name, 0);
          buffers[n.name].clear();
        },
        [&](const IfThenElse& n) {
          run(eval(n.condition)[0].as_bool() ? n.then_case : n.else_case);
        },
        [&](const Evaluate& n) { eval(n.value); }, [&](const ProducerConsumer& n) { run(n.body); },
        [&](const Block& n) {
          for (const Stmt& child : n.stmts) run(child);
        },
        [&](const StmtNode&) { throw std::runtime_error("statement not evaluated: " + print(s)); });
  }

  Value eval(const Expr& e) {
    if (auto constant = as_scalar(e)) return Value(e.type().lanes(), *constant);
    return match(
        e, [&](const Variable& n) { return variable_value(n.name); },
        [&](const Cast& n) {
          return map(eval(n.value),
                     [&](const Scalar& v) { return eval_cast(n.type.element_of(), v); });
        },
        [&](const Binary& n) { return eval_lanes(n); },
        [&](const Not& n) { return map(eval(n.a), [](const Scalar& v) { return eval_not(v); }); },
        [&](const Select& n) {
          Value c = eval(n.condition), t = eval(n.true_value), f = eval(n.false_value), result;
          for (size_t i = 0; i < t.size(); ++i)
            result.push_back(c[c.size() == 1 ? 0 : i].as_bool() ? t[i] : f[i]);
          return result;
        },
        [&](const Load& n) { return eval_load(n); },
        [&](const Ramp& n) {
          Value at = eval(n.base), stride = eval(n.stride), result;
          for (int i = 0; i < n.lanes; ++i) {
            result.insert(result.end(), at.begin(), at.end());
            for (size_t j = 0; j < at.size(); ++j) at[j] = eval_binary(Kind::Add, at[j], stride[j]);
          }
          return result;
        },
        [&](const Broadcast& n) {
          Value value = eval(n.value), result;
          for (int i = 0; i < n.lanes; ++i) result.insert(result.end(), value.begin(), value.end());
          return result;
        },
        [&](const Call& n) { return eval_call(e, n); },
        [&](const Let& n) {
          variables_[n.name] = eval(n.value);
          return eval(n.body);
        },
        [&](const Shuffle& n) {
          Value all, result;
          for (const Expr& v : n.vectors) {
            Value part = eval(v);
            all.insert(all.end(), part.begin(), part.end());
          }
          for (int index : n.indices) result.push_back(all[index]);
          return result;
        },
        [&](const VectorReduce& n) { return eval_reduce(n); },
        [&](const ExprNode&) -> Value {
          throw std::runtime_error("expression not evaluated: " + print(e));
        });
  }

 private:
  std::map<std::string, Value> variables_;

  // What nobody has stored: a value that changes the result when it is used.
  static Scalar poison(Type type) {
    return type.is_float() ? Scalar::of_float(type, 777) : Scalar::of_int(type, 777);
  }

  [[noreturn]] static void fail(const std::string& what, const std::string& name, int64_t index) {
    throw std::runtime_error(what + " outside of " + name + " at " + std::to_string(index));
  }

  Value variable_value(const std::string& name) {
    auto it = variables_.find(name);
    if (it == variables_.end()) throw std::runtime_error("unbound variable " + name);
    return it->second;
  }

  template <class F>
  static Value map(Value v, F f) {
    for (Scalar& lane : v) lane = f(lane);
    return v;
  }

  Value eval_lanes(const Binary& n) {
    Value a = eval(n.a), b = eval(n.b);
    for (size_t i = 0; i < a.size(); ++i) a[i] = eval_binary(n.kind, a[i], b[i]);
    return a;
  }

  Scalar& element(const std::string& what, const std::string& name, int64_t index) {
    auto it = buffers.find(name);
    if (it == buffers.end() || index < 0 || index >= static_cast<int64_t>(it->second.size()))
      fail(what, name, index);
    return it->second[index];
  }

  Value eval_load(const Load& n) {
    Value index = eval(n.index), on = n.predicate.defined() ? eval(n.predicate) : Value(), result;
    for (size_t i = 0; i < index.size(); ++i) {
      bool active = on.empty() || on[i].as_bool();
      result.push_back(active ? element("load", n.name, index[i].i) : poison(n.type.element_of()));
    }
    return result;
  }

  Value eval_call(const Expr& e, const Call& n) {
    if (n.is_op(Op::if_then_else)) return eval(n.args[eval(n.args[0])[0].as_bool() ? 1 : 2]);
    if (n.is_op(Op::print)) {
      Value value = eval(n.args[0]);
      for (const Scalar& lane : value) printed.push_back(lane.i);
      return value;
    }
    std::vector<Value> args;
    for (const Expr& arg : n.args) args.push_back(eval(arg));
    Value result;
    for (int lane = 0; lane < n.type.lanes(); ++lane) {
      std::vector<Scalar> scalars;
      for (const Value& arg : args) scalars.push_back(arg[arg.size() == 1 ? 0 : lane]);
      result.push_back(n.call_type == CallType::Extern ? scalars.at(0) : value_of(e, n, scalars));
    }
    return result;
  }

  static Scalar value_of(const Expr& e, const Call& n, const std::vector<Scalar>& args) {
    auto value = eval_operator(n.op, args, n.type.element_of());
    if (!value) throw std::runtime_error("operator not evaluated: " + print(e));
    return *value;
  }

  Value eval_reduce(const VectorReduce& n) {
    static constexpr Kind kinds[] = {Kind::Add, Kind::Mul, Kind::Min,
                                     Kind::Max, Kind::And, Kind::Or};
    Value all = eval(n.value), result;
    size_t group = all.size() / n.type.lanes();
    for (size_t start = 0; start < all.size(); start += group) {
      Scalar sum = all[start];
      for (size_t i = 1; i < group; ++i)
        sum = eval_binary(kinds[static_cast<int>(n.op)], sum, all[start + i]);
      result.push_back(sum);
    }
    return result;
  }

  void run_loop(const For& n) {
    int64_t min = eval(n.min)[0].i, extent = eval(n.extent)[0].i;
    for (int64_t i = min; i < min + extent; ++i) {
      set(n.name, i);
      run(n.body);
    }
  }

  void run_store(const Store& n) {
    Value on = n.predicate.defined() ? eval(n.predicate) : Value();
    Value value = eval(n.value), index = eval(n.index);
    for (size_t i = 0; i < index.size(); ++i) {
      if (on.empty() || on[i].as_bool()) element("store", n.name, index[i].i) = value[i];
    }
  }
};

}  // namespace retrograde::ir
