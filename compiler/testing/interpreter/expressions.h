// expressions.h -- evaluates expressions in a frame. A branch of a select that is not chosen is never evaluated, so it
// may read outside of its producer's domain.
#pragma once

#include <vector>

#include "testing/interpreter.h"
#include "testing/interpreter/frame.h"
#include "testing/interpreter/inputs.h"

namespace retrograde::oracle {

// Evaluates calls of Funcs.
class FuncReader {
 public:
  virtual ~FuncReader() = default;
  virtual Value read(const graph::FuncContents& func, const Point& point, int component) = 0;
};

class Expressions {
 public:
  Expressions(const InterpreterOptions& options, Inputs& inputs, FuncReader& funcs)
      : options_(options), inputs_(inputs), funcs_(funcs) {}

  // The value at the frame's point; valid until the frame's next evaluation.
  const Value& get(Frame& frame, const Expr& e);
  std::vector<Value> all_of(Frame& frame, const std::vector<Expr>& exprs);
  // Clears `stable` if a coordinate is unstable.
  Point coordinates(Frame& frame, const std::vector<Expr>& args, bool& stable);
  Type widened(Type type) const { return options_.widen && type.is_float() ? Float(64) : type; }

 private:
  Value evaluate(Frame& frame, const Expr& e);
  Value constant(const Expr& e) const;
  Value variable(const Frame& frame, const Expr& e, const ir::Variable& n) const;
  Value binary(Frame& frame, const ir::Binary& n);
  Value select(Frame& frame, const Expr& condition, const Expr& if_true, const Expr& if_false);
  Value reinterpret(Frame& frame, const ir::Reinterpret& n);
  Value call(Frame& frame, const ir::Call& n);
  Value operator_call(Frame& frame, const ir::Call& n);
  Value random(Frame& frame, const ir::Call& n);
  Value require(Frame& frame, const ir::Call& n);
  Value func_call(Frame& frame, const ir::Call& n);
  Value image_call(Frame& frame, const ir::Call& n);
  void check_work() const;

  const InterpreterOptions& options_;
  Inputs& inputs_;
  FuncReader& funcs_;
  uint64_t operations_ = 0;
};

}  // namespace retrograde::oracle
