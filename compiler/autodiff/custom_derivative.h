// custom_derivative.h -- user-defined derivative rules: custom_adjoint and custom_tangent.
//
// Func f("f"), x("x");                                 // f(i) = some function of x, or an extern stage
// custom_adjoint(f, {x}, [x](const AdjointContext& c) {
//   Func x_adj("x_adj");                               // (df / dx)^T f_adj, over all of x
//   x_adj(i) = c.adjoint()(i) * cos(x(i));
//   return std::vector<AdjointContribution>{{x, x_adj}};
// });
//
// Every gradient through f then comes from the rule, whatever f's definitions are: a more stable formula, a surrogate
// for a step function, or a stage that a C function computes. A rule returns Funcs, so its result can be differentiated
// again; its Funcs may have rules, too.
//
// The inputs state what f is a function of: Funcs that it reads directly or through others, images, Buffers, Params.
// Funcs between them and f belong to the rule and get no adjoint from f. Every wanted float that f depends on must be
// one of the inputs, or an input must depend on it. Each wanted input must get a contribution, even an explicit zero.
// Each gradient checks all of this.
//
// A rule lives as long as its Func and the Func's clones. It may run concurrently in several threads that
// differentiate. A rule takes the Func itself from the context: if it captured the Func, or one of its consumers, it
// would keep itself alive for ever.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "autodiff/derivative.h"

namespace retrograde {

// The arguments of a rule for adjoints.
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
  // The adjoint of func() after its last definition, with its dimensions and number of values, float32 or wider. It is
  // 0 outside of region(). A partial p may be NaN there, because its value is never used: multiply by
  // select(is_finite(p), p, 0).
  const Func& adjoint() const { return adjoint_; }
  // The region that the output depends on: min and extent in each dimension of func(); undefined if unbounded.
  const Region& region() const { return region_; }
  // Whether a contribution to the input is used.
  bool wants(const AdjointInput& input) const;
  // The region of a wanted input that the output depends on; a contribution counts as 0 elsewhere. Undefined ends mean
  // everywhere. Empty if the input is not wanted.
  Region region_of(const AdjointInput& input) const;

 private:
  Func func_, adjoint_;
  Region region_;
  std::vector<Wanted> wanted_;
};

// The contribution of a rule to the adjoint of one input.
//   adjoint  a Func with the dimensions of the input (none for a Param) and its number of values; floats.
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

// For extern stages: the region of a Func or image argument that a region of the Func needs, as the stage answers a
// bounds query. An empty Region means all of the argument, without bounds; then an adjoint that sums over the argument
// is not supported.
// Requires: a region has min and extent in each dimension of the argument.
using ExternReads = std::function<Region(const AdjointInput& argument, const Region& of_func)>;

// Sets the rule by which adjoints pass through `func`; replaces an earlier rule.
// Requires: a rule belongs to a Func that is defined; only floating-point values have derivatives;
// a rule is a function; its inputs must be defined; each input is listed once; its inputs are what
// the Func is computed from; what a Func reads is told for extern stages only; its custom adjoint
// must know every input whose gradient is wanted; a rule contributes to the inputs that it was made
// for; each input gets one contribution; each wanted input gets a contribution; a Func with a
// custom adjoint needs a rule for tangents, too (Unsupported).
void custom_adjoint(const Func& func, const std::vector<AdjointInput>& inputs, CustomAdjoint rule,
                    ExternReads reads = nullptr);

// The arguments of a rule for tangents.
class TangentContext {
 public:
  using Moving = std::vector<std::pair<const ir::Symbol*, Func>>;
  TangentContext(Func func, std::vector<AdjointInput> inputs, Moving moving)
      : func_(std::move(func)), inputs_(std::move(inputs)), moving_(std::move(moving)) {}

  const Func& func() const { return func_; }
  // Whether the input has a nonzero tangent.
  // Requires: a rule asks for the tangents of its inputs.
  bool moves(const AdjointInput& input) const;
  // The tangent of an input, with its dimensions and number of values; zeros if the input does not move.
  Func tangent(const AdjointInput& input) const;

 private:
  Func func_;
  std::vector<AdjointInput> inputs_;
  Moving moving_;
};

// Returns the tangent of the Func, with its dimensions and number of values; floats.
using CustomTangent = std::function<Func(const TangentContext&)>;

// Sets the rule by which tangents pass through `func`; otherwise like custom_adjoint.
// Requires: its custom tangent must know every input that moves; a Func with a custom tangent needs
// a rule for adjoints, too (Unsupported).
void custom_tangent(const Func& func, const std::vector<AdjointInput>& inputs, CustomTangent rule);

}  // namespace retrograde
