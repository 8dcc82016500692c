// check_stability.h -- how much precision a pipeline and its adjoint lose, and where they break.
//
// StabilityReport report = check_stability(loss, {}, {.extremes = {Extreme::Zeros,
// Extreme::Huge}}); std::ofstream("stability.json") << report.to_json();
//
// The pipeline and the adjoint of the output (seeded with ones) run in their own precision and in
// double on the same inputs: as bound, and with a quarter of each input's elements replaced by an
// extreme. Afterwards the inputs hold what they held before.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "frontend/func.h"

namespace retrograde {

enum class Extreme { Zeros, Denormals, Huge, Tiny, Infinities, NaNs };
const char* to_string(Extreme extreme);

struct StabilityOptions {
  std::vector<Extreme> extremes = {Extreme::Zeros, Extreme::Denormals,  Extreme::Huge,
                                   Extreme::Tiny,  Extreme::Infinities, Extreme::NaNs};
  int perturbations = 3;  // random roundings of the inputs, for the condition estimate
  unsigned seed = 1;
};

struct StabilityReport {
  // Of one Func (or, is_adjoint, of its adjoint) on one set of inputs.
  struct FuncResult {
    std::string name;
    bool is_adjoint = false;
    double worst_error = 0;  // against double, relative to its largest finite element
    double condition =
        0;                // relative change of it for a relative change of the inputs; 0: not asked
    long non_finite = 0;  // elements
    long lost = 0;        // of them, those that are finite in double
  };
  struct Case {
    std::string name;               // "as bound", or of the extreme
    std::vector<FuncResult> funcs;  // producers first, then adjoints from the output back
    // The first in that order that has an element which is finite in double but not in the
    // pipeline's precision: where it came from. Empty: none.
    std::string first_lost;
    // The first that is not finite in double either.
    std::string first_non_finite;
  };
  std::vector<Case> cases;

  std::string to_json() const;
};

// As check_gradients. Funcs of several values, and those whose region is not known before it runs,
// are left out.
StabilityReport check_stability(const Func& output, const std::vector<int>& sizes = {},
                                const StabilityOptions& options = {});

}  // namespace retrograde
