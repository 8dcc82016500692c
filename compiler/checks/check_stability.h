// check_stability.h -- how much precision a pipeline and its adjoint lose, and where they break.
//
// StabilityReport report = check_stability(loss, {}, {.extremes = {Extreme::Zeros, Extreme::Huge},
//                                                     .ranges = {{photo, 0, 1}}});
// std::ofstream("stability.json") << report.to_json();     // tools/plot_report draws it
//
// The pipeline and the adjoint of the output (seeded with ones) run in their own precision and in
// double on the same inputs: as bound; with a quarter of each input's elements replaced by an
// extreme; drawn from declared ranges, and at the ends of these. Afterwards the inputs hold what
// they held before.
//
// Two estimates say whose fault an error is. `condition`: the inputs move by random roundings, and
// everything else is exact; large means that the problem itself is ill posed. `rounding`: the
// inputs stay, and every value that any Func computes is rounded at random; large with a small
// condition means that the pipeline loses digits that the problem has.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"

namespace retrograde {

enum class Extreme { Zeros, Denormals, Huge, Tiny, Infinities, NaNs };
const char* to_string(Extreme extreme);

// Values that an input may take: uniform, or, when the ends are positive and 1,000 times apart,
// uniform in the logarithm.
struct InputRange {
  AdjointInput input;
  double low, high;
};

struct StabilityOptions {
  std::vector<Extreme> extremes = {Extreme::Zeros, Extreme::Denormals,  Extreme::Huge,
                                   Extreme::Tiny,  Extreme::Infinities, Extreme::NaNs};
  std::vector<InputRange> ranges = {};  // other inputs stay as bound
  int samples = 3;                      // drawn from the ranges
  int perturbations = 3;                // random roundings, for each of the two estimates
  unsigned seed = 1;
  std::vector<int> mins = {};  // where the output begins; empty: at 0
};

struct StabilityReport {
  // Of one value of one Func (or, is_adjoint, of its adjoint) on one set of inputs.
  struct FuncResult {
    std::string name;
    bool is_adjoint = false;
    int value = 0;           // of a Tuple
    double worst_error = 0;  // against double, relative to its largest finite element
    // Relative change for relative changes of the size of a rounding, over that size: of the
    // inputs, and of all values on the way. 0: not asked, or no change.
    double condition = 0, rounding = 0;
    long non_finite = 0;  // elements
    long lost = 0;        // of them, those that are finite in double
  };
  // An element that is not finite.
  struct Place {
    std::string func;
    bool is_adjoint = false;
    int value = 0;
    std::vector<int> at;
    double own = 0, in_double = 0;
    // The first operation of the Func's definition, in the order of evaluation, whose result is not
    // finite there; "image(3, 4), an input" when that is where it came from; in an update, with the
    // iteration.
    std::string operation;
  };
  struct Case {
    std::string name;  // "as bound", of the extreme, "in the ranges", "at the ends ..."
    std::vector<FuncResult> funcs;  // producers first, then adjoints from the output back
    // The first in that order that is finite in double but not in the pipeline's precision, and the
    // first that is not finite in double either.
    std::optional<Place> first_lost, first_non_finite;
  };
  // What was not looked at, and why.
  struct LeftOut {
    std::string name, reason;
  };
  std::vector<Case> cases;
  std::vector<LeftOut> left_out;

  std::string to_json() const;
};

// `sizes` as of check_gradients.
// Requires: every input must be bound (RuntimeError); the output needs a size in each of its
// dimensions, and a min in each or none; a range has two finite ends, the lower first; a range is
// one of a floating input that the output depends on; every operation needs a meaning in double
// (Unsupported).
StabilityReport check_stability(const Func& output, const std::vector<int>& sizes = {},
                                const StabilityOptions& options = {});

}  // namespace retrograde
