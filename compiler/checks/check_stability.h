// check_stability.h -- measures how much precision a pipeline and its adjoint lose, and where their values stop being
// finite.
//
// StabilityReport report = check_stability(loss, {}, {.extremes = {Extreme::Zeros, Extreme::Huge},
//                                                     .ranges = {{photo, 0, 1}}});
// std::ofstream("stability.json") << report.to_json();     // tools/plot_report draws it
//
// The pipeline and the adjoint of the output (with a seed of ones) run in their own precision and in double on the same
// inputs: the bound values; these with a quarter of each input's elements replaced by an extreme; values drawn from
// declared ranges, and the ends of these ranges. Afterwards the inputs are restored.
//
// Two estimates separate the causes of an error. `condition` perturbs the inputs by random roundings and computes
// everything else exactly; a large value means that the problem itself is ill-conditioned. `rounding` keeps the inputs
// and rounds every computed value of every Func at random; a large value beside a small condition means that the
// pipeline loses digits that the problem has.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"

namespace retrograde {

enum class Extreme { Zeros, Denormals, Huge, Tiny, Infinities, NaNs };
const char* to_string(Extreme extreme);

// The range of an input. Values are drawn uniformly or, if the ends are positive and at least a factor of 1,000 apart,
// uniformly in the logarithm.
struct InputRange {
  AdjointInput input;
  double low, high;
};

struct StabilityOptions {
  std::vector<Extreme> extremes = {Extreme::Zeros, Extreme::Denormals,  Extreme::Huge,
                                   Extreme::Tiny,  Extreme::Infinities, Extreme::NaNs};
  std::vector<InputRange> ranges = {};  // other inputs keep their bound values
  int samples = 3;                      // number of samples from the ranges
  int perturbations = 3;                // random roundings, for each of the two estimates
  unsigned seed = 1;
  std::vector<int> mins = {};  // where the output begins; empty: at 0
};

struct StabilityReport {
  // The result for one value of one Func (if is_adjoint, of its adjoint) on one set of inputs.
  struct FuncResult {
    std::string name;
    bool is_adjoint = false;
    int value = 0;           // index within a Tuple
    double worst_error = 0;  // against double, relative to its largest finite element
    // The relative change of the value, divided by a relative perturbation of one rounding: of the inputs (condition),
    // or of all intermediate values (rounding). 0 means not estimated, or no change.
    double condition = 0, rounding = 0;
    long non_finite = 0;  // number of elements that are not finite
    long lost = 0;        // number of these that are finite in double
  };
  // An element that is not finite.
  struct Place {
    std::string func;
    bool is_adjoint = false;
    int value = 0;
    std::vector<int> at;
    double own = 0, in_double = 0;
    // The first operation of the Func's definition, in the order of evaluation, whose result is not finite there; for
    // an update with the iteration. "image(3, 4), an input" if the value comes from an input.
    std::string operation;
  };
  struct Case {
    std::string name;  // "as bound", name of the extreme, "in the ranges", "at the ends ..."
    std::vector<FuncResult> funcs;  // producers first, then adjoints from the output back
    // The first element, in that order, that is finite in double but not in the pipeline's precision, and the first
    // that is not finite in double either.
    std::optional<Place> first_lost, first_non_finite;
  };
  // A Func that was not checked, and the reason.
  struct LeftOut {
    std::string name, reason;
  };
  std::vector<Case> cases;
  std::vector<LeftOut> left_out;

  std::string to_json() const;
};

// `sizes` as for check_gradients.
// Requires: every input must be bound (RuntimeError); the output needs a size in each of its
// dimensions, and a min in each or none; a range has two finite ends, the lower first; a range is
// one of a floating input that the output depends on; every operation needs a meaning in double
// (Unsupported).
StabilityReport check_stability(const Func& output, const std::vector<int>& sizes = {},
                                const StabilityOptions& options = {});

}  // namespace retrograde
