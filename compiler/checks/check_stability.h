// check_stability.h -- measures how much precision a pipeline and its adjoint lose, and where they overflow.
//
// StabilityReport report = check_stability(loss, {}, {.extremes = {Extreme::Zeros, Extreme::Huge},
//                                                     .ranges = {{photo, 0, 1}}});
// std::ofstream("stability.json") << report.to_json();     // tools/plot_report draws it
//
// The pipeline and the adjoint of the output (seeded with ones) run in their own precision and in double, on the same
// inputs: as bound; with a quarter of each input's elements replaced by an extreme; with samples from declared ranges;
// and with the ends of these ranges. Afterwards the inputs are restored.
//
// Two estimates attribute an error. `condition` rounds the inputs at random and computes exactly; if it is large, the
// problem itself is ill conditioned. `rounding` keeps the inputs and rounds every computed value of every Func at
// random; if it is large and `condition` is small, the pipeline loses digits that the problem has.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"

namespace retrograde {

// Extreme values that inputs are tested with.
enum class Extreme { Zeros, Denormals, Huge, Tiny, Infinities, NaNs };
// The name in reports.
const char* to_string(Extreme extreme);

// A range of values for an input. Samples are uniform, or uniform in the logarithm if both ends are positive
// and a factor of 1,000 apart.
struct InputRange {
  AdjointInput input;  // the input
  double low, high;    // ends of the range
};

// Options of check_stability.
struct StabilityOptions {
  // Extremes to test.
  std::vector<Extreme> extremes = {Extreme::Zeros, Extreme::Denormals,  Extreme::Huge,
                                   Extreme::Tiny,  Extreme::Infinities, Extreme::NaNs};
  std::vector<InputRange> ranges = {};  // other inputs keep their bound values
  int samples = 3;                      // number of samples from the ranges
  int perturbations = 3;                // random roundings for each of the two estimates
  unsigned seed = 1;                    // seeds samples and roundings
  std::vector<int> mins = {};           // where the output begins; empty: at 0
};

// Result of check_stability.
struct StabilityReport {
  // Errors of one value of a Func, or of its adjoint, on one set of inputs.
  struct FuncResult {
    std::string name;         // name of the Func
    bool is_adjoint = false;  // whether this is the adjoint of the Func
    int value = 0;            // index in a Tuple
    double worst_error = 0;   // against double, relative to its largest finite element
    // Relative change of the result over the size of a rounding, for random roundings of the inputs
    // (condition) or of all intermediate values (rounding). 0: not estimated, or no change.
    double condition = 0, rounding = 0;
    long non_finite = 0;  // number of elements that are not finite
    long lost = 0;        // number of those that are finite in double
  };
  // An element that is not finite.
  struct Place {
    std::string func;               // name of the Func
    bool is_adjoint = false;        // whether it is in the adjoint of the Func
    int value = 0;                  // index in a Tuple
    std::vector<int> at;            // coordinates
    double own = 0, in_double = 0;  // its value in the pipeline's precision and in double
    // The first operation of the definition, in evaluation order, whose result is not finite there; for an
    // update, with the iteration. If the value comes from an input: "image(3, 4), an input".
    std::string operation;
  };
  // The results on one set of inputs.
  struct Case {
    std::string name;               // "as bound", an extreme, "in the ranges", "at the ends ..."
    std::vector<FuncResult> funcs;  // producers first, then adjoints from the output back
    // In that order, the first element that is finite in double only, and the first that is not finite in
    // double either.
    std::optional<Place> first_lost, first_non_finite;
  };
  // A Func that was not checked.
  struct LeftOut {
    std::string name, reason;  // the Func and why it was skipped
  };
  std::vector<Case> cases;        // one for each set of inputs
  std::vector<LeftOut> left_out;  // Funcs that were not checked

  std::string to_json() const;  // the report for tools/plot_report
};

// Compares `output` over `sizes`, and its adjoint, with double precision on several sets of inputs.
// Requires: every input must be bound (RuntimeError); the output needs a size in each of its dimensions, and
// a min in each or none; a range has two finite ends, the lower first; a range belongs to a floating input
// that the output depends on; every operation needs a meaning in double (Unsupported).
StabilityReport check_stability(const Func& output, const std::vector<int>& sizes = {},
                                const StabilityOptions& options = {});

}  // namespace retrograde
