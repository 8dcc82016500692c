// derivative.h -- reverse-mode gradients of pipelines: propagate_adjoints and its result, Derivative.
//
// Func loss; RDom r(input); loss() += pow(model(r.x, r.y) - target(r.x, r.y), 2);
// Derivative d = propagate_adjoints(loss);
// Func grad = d(weights);            // weights: a Func, Buffer, ImageParam or Param
//
// The adjoint of a Func or image has its dimensions; that of a Param has none. It is 0 outside of the region that the
// outputs depend on. Adjoints are ordinary Funcs without side effects, so they can be scheduled and differentiated
// again.
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

// The operations to compute the outputs, and those to compute all requested gradients (by default: by all images and
// parameters), each as a pipeline of its own. Primal values that the gradients read count among the gradients.
struct GradientOperations {
  autodiff::OperationCount primal, gradient;
  // gradient over primal; nullopt if a count depends on extents known at run time only. By the cheap-gradient principle
  // it is bounded by a small constant, whatever the number of inputs.
  std::optional<double> ratio() const;
};

class Derivative {
 public:
  explicit Derivative(std::shared_ptr<const autodiff::SynthesisResult> result);

  // The adjoint of `func` as it is after update definition `update_id`; -1 means after its pure definition. For a Func
  // that is only accumulated into, all of these are equal. A Func that only reads an image point by point, and that the
  // output does not use, is treated as the image.
  //
  // The adjoint is zero everywhere if the output does not depend on the Func, and for integers; explanations() then
  // gives the reason. A Buffer that is bound to an ImageParam is not the same input as the ImageParam. A gradient is
  // not built if `wrt` names other inputs only, if a custom adjoint covers the Func, or if its steps are not kept.
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
  // The adjoint of an input of any kind.
  Func of(const AdjointInput& input) const;
  // Whether a gradient by the input was built. Otherwise of() returns a Func of zeros or throws.
  bool has(const AdjointInput& input) const;
  // The Func that sums up an adjoint, for schedules by hand: the adjoint itself or, if an element gets many terms
  // (accumulation.h), the Func in double that the adjoint rounds.
  Func accumulator(const Func& adjoint) const;

  // All generated Funcs, producers before consumers: adjoints, privatised copies, helpers.
  std::vector<Func> funcs() const;
  // Facts about the gradients: what was built and how, what was not requested, and why a gradient is zero. These
  // include gradients that were looked up later and that the output does not depend on.
  std::vector<Explanation> explanations() const;
  // Facts about memory and operations, with the current schedules of the Funcs: which values are stored or recomputed,
  // in bytes and operations, and which primal values are not needed. They describe the requested gradients, computed
  // together as one pipeline (operation_count.h defines what counts).
  std::vector<Explanation> costs() const;
  // Both kinds of facts as text. The summary has a line for the cost and one each for what is stored, recomputed,
  // scattered, zero or left out. Detail::All has a line for every fact with its reason.
  std::string explain(Detail detail = Detail::Summary) const;
  // Counted with the current schedules of the Funcs.
  GradientOperations operations() const;

 private:
  Func of_parameter(const std::shared_ptr<const graph::ParameterContents>& parameter) const;
  Func absent(const std::shared_ptr<const ir::Symbol>& symbol, const std::string& name) const;
  bool outputs_use(const graph::FuncContents& f) const;
  std::shared_ptr<const autodiff::SynthesisResult> result_;
  std::shared_ptr<ZeroGradients> zeros_;  // zero gradients that were looked up
};

// How to handle an update that overwrites a value which a partial derivative needs.
enum class Overwritten {
  // Keep the versions, in Funcs with one more dimension or in copies, if all of them fit into
  // AdjointOptions::version_bytes; else throw a CompileError. If sizes are known at run time only, a call that needs
  // more fails. explain() lists the versions kept.
  Auto,
  Refuse,  // throw a CompileError that names the update, the value and the rewrite
  Store,   // keep the versions whatever their size
  Error = Refuse,
};

// An input to differentiate by: a Func, image, Buffer or Param.
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
  // A budget for loops over time: updates whose outermost reduction variable is time, run n times, which overwrite
  // values that their partials need. Instead of all n versions a few states of the Func are kept, and the steps between
  // them are recomputed. With s states this takes the least number of steps, r n - C(s + r, r - 1) for C(s + r - 1, s)
  // < n <= C(s + r, s) (revolve: A. Griewank, A. Walther, Algorithm 799, ACM Transactions on Mathematical Software
  // 26(1), 2000).
  //
  // n may be known at run time only, as a Param or an extent of an input. Then the pipeline computes a table of about
  // (r + 3) n rows of 12 bytes; a call whose n needs more than 2^24 rows fails.
  //
  // A Func that keeps its steps along a dimension of its own, f(x, t + 1) = g(f(x, t)), is run the same way if other
  // Funcs read only its last steps (overwrite_time.h); then it has no adjoint of its own, unless it is in `wrt`. If
  // every step is read, the steps are kept, and explain() says so.
  //
  // Gradients have the same bits for every budget; other updates follow `overwritten`. Set one of the two: the number
  // of states kept, at least 1, or the bytes that they may take, enough for one state.
  std::optional<int> checkpoint_states = {};
  std::optional<int64_t> checkpoint_bytes = {};
};

// The gradient of the sum over output_bounds of adjoint * output, with respect to everything that `output` depends on.
// output_bounds: min and extent of each dimension of the output; `adjoint` is read there only.
// Requires: the output must be defined; only floating-point values have derivatives; the output
// needs bounds in each of its dimensions; an adjoint has the dimensions of its Func; an adjoint has
// as many values as its Func; the adjoint must be defined; a Func with a custom tangent needs a
// rule for adjoints, too (Unsupported); derivatives come from definitions (Unsupported); a C
// function has no known derivative (Unsupported); elements of a scatter have 32-bit numbers: there
// may be 2147483647 at most (Unsupported); every variable needs a range.
Derivative propagate_adjoints(const Func& output, const Func& adjoint, const Region& output_bounds,
                              const AdjointOptions& options = {});
// One of several outputs: its adjoint over output_bounds, as above.
struct OutputAdjoint {
  Func output, adjoint;
  Region output_bounds;
};
// The gradient of the sum over all outputs of what the form above differentiates, in one backward pass: what the outputs
// have in common is differentiated once. An output may read another, and may occur more than once.
// Requires: there is at least one output.
Derivative propagate_adjoints(const std::vector<OutputAdjoint>& outputs,
                              const AdjointOptions& options = {});
// The same with an adjoint in memory, whose shape gives the bounds.
// Requires: the adjoint must be a defined Buffer.
Derivative propagate_adjoints(const Func& output, const Buffer<float>& adjoint,
                              const AdjointOptions& options = {});
// The gradient of a Func without dimensions: the adjoint of its value is 1.
// Requires: a scalar output has one value; the gradient is that of a scalar, or of a sum with given
// weights.
Derivative propagate_adjoints(const Func& output, const AdjointOptions& options = {});

}  // namespace retrograde
