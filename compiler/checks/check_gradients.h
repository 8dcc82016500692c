// check_gradients.h -- compares the derivatives of a pipeline with differences of its values.
//
// Func loss; ...; photo.set(buffer);                 // every input bound
// GradientReport report = check_gradients(loss);
// EXPECT_LT(report.worst_error, 1e-7);
// std::ofstream("report.json") << report.to_json();  // tools/plot_report draws it
//
// The output (over `sizes`, from `mins`) is summed with random weights w. For random directions v of each floating
// input, four slopes are computed in double:
//   the adjoint <v, J^T w>;
//   the tangent <J v, w>;
//   central differences over steps of many sizes with Richardson extrapolation;
//   a complex step, if the program allows it (checks/complex_step.h).
// The step of the differences is the one at which two neighbouring extrapolations agree best. The adjoint in its own
// precision, as users run it, is compared with the one in double, Func by Func.
#pragma once

#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"

namespace retrograde {

// Options of check_gradients.
struct GradientCheckOptions {
  int directions = 3;                  // number of directions for each input
  unsigned seed = 1;                   // seeds directions and weights
  int smallest_step = 24;              // steps are 2^-4 ... 2^-smallest_step of the input's size
  std::vector<AdjointInput> wrt = {};  // inputs to check; empty: all floating ones
  std::vector<int> mins = {};          // where the output begins; empty: at 0
};

// Result of check_gradients.
struct GradientReport {
  // The error of the differences with one step size.
  struct Step {
    double step;                             // relative to the input's size
    double central_error, richardson_error;  // relative to the adjoint in double
    double seconds;                          // of the two runs of the primal
  };
  // One method for the derivative along the first direction.
  struct Method {
    std::string name;  // name of the method
    double error;      // relative to the complex step, or else to the adjoint in double
    double seconds;    // run time; of the adjoint: for the derivatives by all elements
  };
  // The errors of the derivative with respect to one input.
  struct Input {
    std::string name;                // name of the input
    double adjoint_error = 0;        // adjoint in double against the chosen differences, worst
    double complex_step_error = 0;   // adjoint in double against the complex step, worst
    double dot_product_error = 0;    // adjoint against tangent, both in double, worst
    double own_precision_error = 0;  // adjoint in its own precision against double, worst
    std::vector<Step> steps;         // along the first direction
    std::vector<Method> methods;     // along the first direction
  };
  // The rounding error of the adjoint of one Func.
  struct FuncError {
    std::string name;  // name of the Func
    double error;      // in its own precision, relative to its largest element
    double lost;       // error over that of the worst adjoint that it is computed from
  };

  std::vector<Input> inputs;         // one for each checked input
  std::vector<FuncError> funcs;      // from the output back to the inputs
  std::string loses_digits;          // Func whose adjoint adds most to the error; empty: none
  std::string complex_step_refused;  // why there is no complex step; empty if there is one
  double worst_error = 0;            // worst error of adjoints and tangents in double
  double primal_seconds = 0, adjoint_seconds = 0;  // run times in their own precision

  std::string to_json() const;  // the report for tools/plot_report
};

// Checks the derivatives of `output` over `sizes` (empty for a scalar) with respect to its floating inputs.
// All floating values of a Tuple are summed. The rules of propagate_adjoints apply.
// Requires: every input must be bound (RuntimeError); the output needs a size in each of its
// dimensions, and a min in each or none; `wrt` names floating inputs that the output depends on;
// derivatives are of floats (Unsupported); every operation needs a meaning in double (Unsupported).
GradientReport check_gradients(const Func& output, const std::vector<int>& sizes = {},
                               const GradientCheckOptions& options = {});

}  // namespace retrograde
