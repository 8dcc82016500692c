// custom_derivative.h -- derivatives that a user writes: custom_adjoint, custom_tangent.
//
// Func f("f"), x("x");                                 // f(i) = something of x, or an extern stage
// custom_adjoint(f, {x}, [x](const AdjointContext& c) {
//   Func x_adj("x_adj");                               // (df / dx)^T f_adj, over the whole of x
//   x_adj(i) = c.adjoint()(i) * cos(x(i));
//   return std::vector<AdjointContribution>{{x, x_adj}};
// });
//
// From then on every gradient through f comes from the rule, whatever f's definitions say: for a
// better formula, a surrogate of a step, or a stage that a C function computes. A rule is made of
// Funcs, so what it gives is differentiated again like anything else; its Funcs may have rules too.
//
// The inputs say what f is a function of: Funcs that it reads directly or through others, images,
// Buffers, Params. What lies between them and f belongs to the rule and gets no adjoint from f.
// Every wanted float that f depends on must be among the inputs, or behind one that is; each wanted
// input must get a contribution, be it an explicit zero. All of this is checked for each gradient.
//
// A rule lives as long as its Func and the Func's clones. It may run at the same time in several
// threads that differentiate. It takes the Func itself from the context: a rule that captured it,
// or one of its readers, would keep itself alive for ever.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "autodiff/derivative.h"

namespace retrograde {

// What a rule for adjoints is given.
class AdjointContext {
 public:
  struct Wanted {
    const ir::Symbol* input;
    Region region;
  };
  AdjointContext(Func func, Func adjoint, Region region, std::vector<Wanted> wanted)
      : func_(std::move(func)),
        adjoint_(std::move(adjoint)),
        region_(std::move(region)),
        wanted_(std::move(wanted)) {}

  // The Func with the rule; its values may be used.
  const Func& func() const { return func_; }
  // The adjoint of func() after its last definition: its dimensions and number of values, float32
  // or wider. 0 outside of region(), where a partial p may be NaN as nobody reads it there: multiply
  // by select(is_finite(p), p, 0).
  const Func& adjoint() const { return adjoint_; }
  // What the output depends on: min and extent in each dimension of func(); undefined where it has
  // no bounds.
  const Region& region() const { return region_; }
  // Whether a contribution to the input is used.
  bool wants(const AdjointInput& input) const;
  // Where a contribution to a wanted input is used: what the output depends on; it counts as 0
  // elsewhere. Undefined ends: everywhere. Empty when it is not wanted.
  Region region_of(const AdjointInput& input) const;

 private:
  Func func_, adjoint_;
  Region region_;
  std::vector<Wanted> wanted_;
};

// What a rule adds to the adjoint of one input.
//   adjoint  a Func with the dimensions of the input (none for a Param) and as many values; floats.
//            It is read over region_of(input).
struct AdjointContribution {
  AdjointContribution(AdjointInput input, const Func& adjoint)
      : input(std::move(input)), adjoint(adjoint) {}
  // A derivative that is identically zero.
  static AdjointContribution zero(AdjointInput input);

  AdjointInput input;
  Func adjoint;
  bool is_zero = false;
};

using CustomAdjoint = std::function<std::vector<AdjointContribution>(const AdjointContext&)>;

// For extern stages: which region of one of its Func or image arguments a region of the Func needs,
// as its answer to a bounds query says. An empty Region: all of it, without bounds; then an adjoint
// that sums over the argument cannot be built.
// Requires: a region has min and extent in each dimension of the argument.
using ExternReads = std::function<Region(const AdjointInput& argument, const Region& of_func)>;

// Adjoints pass through `func` by `rule`. Replaces an earlier rule.
// Requires: a rule belongs to a Func that is defined; only floating-point values have derivatives;
// a rule is a function; its inputs must be defined; each input is listed once; its inputs are what
// the Func is computed from; what a Func reads is told for extern stages only; its custom adjoint
// must know every input whose gradient is wanted; a rule contributes to the inputs that it was made
// for; each input gets one contribution; each wanted input gets a contribution; a Func with a
// custom adjoint needs a rule for tangents, too (Unsupported).
void custom_adjoint(const Func& func, const std::vector<AdjointInput>& inputs, CustomAdjoint rule,
                    ExternReads reads = nullptr);

// What a rule for tangents is given.
class TangentContext {
 public:
  using Moving = std::vector<std::pair<const ir::Symbol*, Func>>;
  TangentContext(Func func, std::vector<AdjointInput> inputs, Moving moving)
      : func_(std::move(func)), inputs_(std::move(inputs)), moving_(std::move(moving)) {}

  const Func& func() const { return func_; }
  // Whether the input has a tangent other than zero.
  // Requires: a rule asks for the tangents of its inputs.
  bool moves(const AdjointInput& input) const;
  // The tangent of an input: its dimensions and number of values; zeros when it does not move.
  Func tangent(const AdjointInput& input) const;

 private:
  Func func_;
  std::vector<AdjointInput> inputs_;
  Moving moving_;
};

// Gives the tangent of the Func: its dimensions and number of values; floats.
using CustomTangent = std::function<Func(const TangentContext&)>;

// Tangents pass through `func` by `rule`; otherwise as custom_adjoint.
// Requires: its custom tangent must know every input that moves; a Func with a custom tangent needs
// a rule for adjoints, too (Unsupported).
void custom_tangent(const Func& func, const std::vector<AdjointInput>& inputs, CustomTangent rule);

}  // namespace retrograde
