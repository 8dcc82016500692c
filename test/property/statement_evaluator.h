// Runs a flat statement on small buffers, lane by lane, with the scalar operations of ir/scalar.h. Passes must preserve
// its result. Reading or writing outside of a buffer, or in a freed one, throws an exception that describes the access.
#pragma once

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/evaluate.h"

namespace retrograde::ir {

class StatementEvaluator : public test::LaneEvaluator {
 public:
  using Value = test::Lanes;
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
          run(eval(n.condition)[0].as_bool() ? n.when_true : n.when_false);
        },
        [&](const Evaluate& n) { eval(n.value); }, [&](const ProducerConsumer& n) { run(n.body); },
        [&](const Block& n) {
          for (const Stmt& child : n.stmts) run(child);
        },
        [&](const StmtNode&) { throw std::runtime_error("statement not evaluated: " + print(s)); });
  }

 private:
  // The value of memory before the first store; it changes the result if it is used.
  static Scalar poison(Type type) {
    return type.is_float() ? Scalar::of_float(type, 777) : Scalar::of_int(type, 777);
  }

  [[noreturn]] static void fail(const std::string& what, const std::string& name, int64_t index) {
    throw std::runtime_error(what + " outside of " + name + " at " + std::to_string(index));
  }

  Scalar& element(const std::string& what, const std::string& name, int64_t index) {
    auto it = buffers.find(name);
    if (it == buffers.end() || index < 0 || index >= static_cast<int64_t>(it->second.size()))
      fail(what, name, index);
    return it->second[index];
  }

  Value load(const Load& n) override {
    Value index = eval(n.index), on = n.predicate.defined() ? eval(n.predicate) : Value(), result;
    for (size_t i = 0; i < index.size(); ++i) {
      bool active = on.empty() || on[i].as_bool();
      result.push_back(active ? element("load", n.name, index[i].i) : poison(n.type.element_of()));
    }
    return result;
  }

  Value call(const Call& n) override {
    if (n.is_op(Op::if_then_else)) return eval(n.args[eval(n.args[0])[0].as_bool() ? 1 : 2]);
    if (!n.is_op(Op::print)) return LaneEvaluator::call(n);
    Value value = eval(n.args[0]);
    for (const Scalar& lane : value) printed.push_back(lane.i);
    return value;
  }
  Scalar other_call(const Call&, const Value& args) override { return args.at(0); }

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
