// derivative_pair.h -- the adjoint of a pipeline in its own precision and its adjoint and tangents in double.
//
// Custom derivative rules consist of Funcs in the user's precision. To check them, the Funcs of the adjoint are widened
// to double; their constants keep their values. Without custom rules the widened pipeline is differentiated.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "checks/arrays.h"
#include "checks/widen.h"

namespace retrograde::checks {

class DerivativePair {
 public:
  // `weights`: the seed of the adjoint, one array for each value of the output; empty for integers. `asked` begins the
  // message if an input is not bound (RuntimeError).
  DerivativePair(const Func& output, const Shape& shape, const std::vector<Values>& weights,
                 std::string asked);

  // The output in double, and the floating inputs that it depends on.
  const Func& wide_output() const { return wide_output_; }
  std::vector<Input>& inputs() { return inputs_; }

  // The adjoints of an input, or of a Func that the output depends on; undefined for a Func without one.
  Func own_adjoint(const Input& input) const;
  Func wide_adjoint(const Input& input) const;
  Func own_adjoint(const FuncPtr& f) const;
  Func wide_adjoint(const FuncPtr& f) const;
  // The change of the output in double along a direction of the input. Funcs without a custom tangent rule are
  // differentiated.
  Func tangent(const Input& input, const Buffer<>& direction) const;

 private:
  bool has_rules() const;
  void add_adjoints(std::vector<FuncPtr>& to) const;
  Func wide_adjoint(const AdjointInput& input, const AdjointInput& wide) const;
  Func tangent_by_rules(const Input& input, const Buffer<>& direction) const;

  const Func output_;
  const std::string asked_;
  std::unique_ptr<Derivative> own_, wide_;  // wide_: null if there are custom derivative rules
  Widened widened_;
  Func wide_output_;
  std::vector<Input> inputs_;
};

}  // namespace retrograde::checks
