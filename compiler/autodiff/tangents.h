// tangents.h -- forward-mode derivatives of pipelines: propagate_tangents and its result, Tangents.
//
// Func v; v(x, y) = ...;                                  // how the input moves: its direction
// Tangents t = propagate_tangents(model, {{image, v}});   // Funcs in, Funcs out
// Func model_tan = t(model);                              // the derivative of model along v
//
// One propagation gives the derivative of every element of every Func along one direction of the inputs: J v, where
// propagate_adjoints gives w^T J. Nothing is inverted, and every legal update has a tangent: if updates overwrite
// values that their own partials read, the primal is recomputed in step with its tangent. Tangents are ordinary Funcs:
// they can be scheduled, and differentiated again in either mode. Tangents of adjoints are Hessian-vector products.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "autodiff/derivative.h"

namespace retrograde {

namespace autodiff {
struct TangentResult;
}

// One input and the direction in which it moves.
//   input    an ImageParam or Buffer, a Param (a direction without dimensions), or a Func, to whose values the
//            direction is added after its last definition
//   tangent  a Func or Buffer with the dimensions of the input and its number of values; floats. It is read where the
//            input is read
struct Direction {
  Direction(AdjointInput input, const Func& tangent);
  template <typename T, int Dims>
  Direction(AdjointInput input, const Buffer<T, Dims>& tangent)
      : Direction(std::move(input), as_func(Buffer<>(tangent))) {}

  // A Func that reads the buffer.
  static Func as_func(const Buffer<>& buffer);

  AdjointInput input;
  Func tangent;
};

class Tangents {
 public:
  explicit Tangents(std::shared_ptr<const autodiff::TangentResult> result);

  // The derivative of `func` along the directions: its dimensions, and a value for each of its values. The value is
  // float32 if the type is narrower, or an integer, whose tangent is 0. Zero everywhere if no moving input reaches the
  // Func; an undefined Func if the output does not depend on it.
  Func operator()(const Func& func) const;

  // All generated Funcs, producers before consumers.
  std::vector<Func> funcs() const;
  // Facts about the tangents: what was built, what is zero and why, what is recomputed.
  const std::vector<Explanation>& explanations() const;
  std::string explain(Detail detail = Detail::Summary) const {
    return to_string(explanations(), detail);
  }

 private:
  std::shared_ptr<const autodiff::TangentResult> result_;
};

// The tangents of `output` and of all Funcs between it and the directions. No operator without a derivative may lie on
// a path from a moving input (Unsupported).
// Requires: the output must be defined; only floating-point values have derivatives; what moves
// must be defined; something has to move; each input has one direction; a direction must be
// defined; it has the dimensions of its input; it has as many values as its input; it is made of
// floating-point values; derivatives come from definitions (Unsupported); the tangent of undef is
// known where a select chooses it and nothing else is done with it (Unsupported).
Tangents propagate_tangents(const Func& output, const std::vector<Direction>& directions);

}  // namespace retrograde
