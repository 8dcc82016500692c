// derivative.h -- the gradient: propagate_adjoints and what it gives.
//
// Func loss; RDom r(input); loss() += pow(model(r.x, r.y) - target(r.x, r.y), 2);
// Derivative d = propagate_adjoints(loss);
// Func grad = d(weights);            // weights: a Func, Buffer, ImageParam or Param
//
// The adjoint of a Func or image has its dimensions; that of a Param has none. It is 0 outside of
// the region that the output depends on. Adjoints are ordinary Funcs without side effects: they can
// be differentiated again.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "autodiff/report/explain.h"
#include "autodiff/report/operation_count.h"
#include "autodiff/updates/version_budget.h"
#include "frontend/data/buffer.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "frontend/language/func.h"

namespace retrograde {

namespace autodiff {
struct SynthesisResult;
}

class AdjointInput;
class ZeroGradients;

// What the output takes to compute, and what the gradients by all that was requested take (with no
// request: by all images and parameters), each as a pipeline of its own. What the gradients read of
// the primal counts among theirs.
struct GradientOperations {
  autodiff::OperationCount primal, gradient;
  // gradient over primal; nothing where a count depends on extents known at run time only. The
  // cheap-gradient principle bounds it by a small constant, whatever the number of inputs.
  std::optional<double> ratio() const;
};

class Derivative {
 public:
  explicit Derivative(std::shared_ptr<const autodiff::SynthesisResult> result);

  // The adjoint of `func` as it is after update definition `update_id`; -1: after its pure
  // definition. For a Func that is only accumulated into, all of these are the same. A Func that
  // only reads an image point by point, and that the output does not use, stands for the image.
  //
  // Zero everywhere where the output does not depend on it, and for integers; explanations() then
  // say why. (A Buffer that is bound to an ImageParam is something else than the ImageParam.)
  // A gradient is not built where `wrt` names others, a custom adjoint covers it, or its steps are
  // not kept.
  // Requires: a Func has a definition; a Func has an adjoint after each of its definitions; a
  // gradient is looked up that was built, or is zero.
  Func operator()(const Func& func, int update_id = -1) const;
  Func operator()(const Buffer<>& buffer) const;
  Func operator()(const ImageParam& image) const;
  template <typename T>
  Func operator()(const Param<T>& param) const {
    return of_parameter(param.parameter());
  }
  // The adjoint of `func` as its consumers see it: after its last definition.
  Func adjoint(const Func& func) const;
  // The same for an input of any kind.
  Func of(const AdjointInput& input) const;
  // Whether a gradient by it was built: of() gives a Func of zeros, or an error, where none was.
  bool has(const AdjointInput& input) const;
  // Where an adjoint is summed up, for schedules by hand: the adjoint itself; or, where an element
  // gets many terms (accumulation.h), the Func in double that it rounds.
  Func accumulator(const Func& adjoint) const;

  // Everything that was made, producers before consumers: adjoints, private parts, helpers.
  std::vector<Func> funcs() const;
  // What was built and how, what was not requested, and why a gradient is zero: also one that was
  // looked up since and has nothing to do with the output.
  std::vector<Explanation> explanations() const;
  // What of it is stored and what computed again, in bytes and operations, and what of the primal
  // is not needed, with the schedules that the Funcs have now: the gradients that were asked for,
  // computed together as one pipeline (operation_count.h says what counts).
  std::vector<Explanation> costs() const;
  // Both, for people: what it costs and what is stored, computed again, scattered, zero or left
  // out, a line each; or every fact with its reason.
  std::string explain(Detail detail = Detail::Summary) const;
  // Counted with the schedules that the Funcs have now.
  GradientOperations operations() const;

 private:
  Func of_parameter(const std::shared_ptr<const graph::ParameterContents>& parameter) const;
  Func absent(const std::shared_ptr<const ir::Symbol>& symbol, const std::string& name) const;
  bool output_uses(const graph::FuncContents& f) const;
  std::shared_ptr<const autodiff::SynthesisResult> result_;
  std::shared_ptr<ZeroGradients> zeros_;  // that were looked up
};

// What to do about an update that overwrites a value which a partial derivative needs.
enum class Overwritten {
  // Keep the versions, in Funcs with one more dimension or in copies, where all of them together
  // fit AdjointOptions::version_bytes; else a CompileError. Where sizes are known at run time only,
  // a call that needs more fails. explain() says what is kept.
  Auto,
  Refuse,  // a CompileError that names the update, the value and the rewrite
  Store,   // keep the versions whatever they cost
  Error = Refuse,
};

// Something to differentiate by.
class AdjointInput {
 public:
  explicit AdjointInput(std::shared_ptr<ir::Symbol> symbol) : symbol_(std::move(symbol)) {}
  AdjointInput(const Func& f) : symbol_(f.function()) {}
  AdjointInput(const ImageParam& image) : symbol_(image.parameter()) {}
  template <typename T>
  AdjointInput(const Param<T>& param) : symbol_(param.parameter()) {}
  template <typename T, int Dims>
  AdjointInput(const Buffer<T, Dims>& buffer) : symbol_(buffer.parameter()) {}
  const std::shared_ptr<ir::Symbol>& symbol() const { return symbol_; }

 private:
  std::shared_ptr<ir::Symbol> symbol_;
};

// Requires: a schedule has at most 2^24 actions; a budget in bytes needs to know the size of a
// state; the budget must have room for one state, the first; a checkpointed loop forgets the values
// that its steps saw (Unsupported); a budget is a number of states or of bytes; a loop is run
// backward from at least one kept state, the first; a budget is a number of bytes; an update that
// runs backward needs to know the elements it may reach (Unsupported); a partial derivative may
// need only values that are still there when the Func is complete; whether an update writes may not
// depend on the values of the Func that it updates; adjoints pass backward through iterations that
// each update one point at a time (Unsupported).
struct AdjointOptions {
  Overwritten overwritten = Overwritten::Auto;
  int64_t version_bytes = autodiff::default_version_bytes;  // 256 MiB; under Overwritten::Auto
  std::vector<AdjointInput> wrt = {};  // only these gradients are wanted; empty: all
  // A budget for loops over time: updates whose outermost reduction variable is time, run n times,
  // which overwrite values that their partials need. Instead of all n versions, a few states of the
  // Func are kept, and the steps between them are computed again: with s states the least number of
  // steps, r n - C(s + r, r - 1) for C(s + r - 1, s) < n <= C(s + r, s) (revolve: A. Griewank, A.
  // Walther, Algorithm 799, ACM Transactions on Mathematical Software 26(1), 2000). n may be known
  // at run time only: a Param, an extent of an input. Then a table of about (r + 3) n rows of 12
  // bytes is made as the pipeline runs; a call whose n needs more than 2^24 rows fails. A Func that
  // keeps its steps along a dimension of its own, f(x, t + 1) = g(f(x, t)), is run the same way
  // where others read its last steps only (overwrite_time.h): then it has no adjoint of its own, unless
  // it is in `wrt`. Where every step is read it keeps them, and explain() says so. Gradients are
  // the same bits for every budget; other updates follow `overwritten`. Give one: the number of
  // states kept, at least 1, or the bytes that they may take, enough for one.
  std::optional<int> checkpoint_states = {};
  std::optional<int64_t> checkpoint_bytes = {};
};

// The gradient of sum over output_bounds of adjoint * output with respect to everything that
// `output` depends on. output_bounds: min and extent of each dimension of the output; `adjoint` is
// read there only.
// Requires: the output must be defined; only floating-point values have derivatives; the output
// needs bounds in each of its dimensions; an adjoint has the dimensions of its Func; an adjoint has
// as many values as its Func; the adjoint must be defined; a Func with a custom tangent needs a
// rule for adjoints, too (Unsupported); derivatives come from definitions (Unsupported); a C
// function has no known derivative (Unsupported); elements of a scatter have 32-bit numbers: there
// may be 2147483647 at most (Unsupported); every variable needs a range.
Derivative propagate_adjoints(const Func& output, const Func& adjoint, const Region& output_bounds,
                              const AdjointOptions& options = {});
// The same with an adjoint in memory, whose shape gives the bounds.
// Requires: the adjoint must be a defined Buffer.
Derivative propagate_adjoints(const Func& output, const Buffer<float>& adjoint,
                              const AdjointOptions& options = {});
// Of a Func without dimensions: the adjoint of its value is 1.
// Requires: a scalar output has one value; the gradient is that of a scalar, or of a sum with given
// weights.
Derivative propagate_adjoints(const Func& output, const AdjointOptions& options = {});

}  // namespace retrograde
