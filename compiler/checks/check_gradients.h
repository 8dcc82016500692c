// check_gradients.h -- does the derivative agree with differences of the pipeline?
//
// Func loss; ...; photo.set(buffer);                 // every input bound
// GradientReport report = check_gradients(loss);
// EXPECT_LT(report.worst_error, 1e-7);
// std::ofstream("report.json") << report.to_json();  // tools/plot_report draws it
//
// The output (over `sizes`, from `mins`) is summed with random weights w. In double, for random
// directions v of each floating input: the adjoint <v, J^T w>, the tangent <J v, w>, central
// differences over steps of many sizes with Richardson extrapolation, and a complex step where the
// program allows it (checks/complex_step.h). The step of the differences is chosen by themselves:
// where two neighbouring extrapolations agree best. The adjoint as it will run, in its own
// precision, is compared with the one in double, Func by Func.
#pragma once

#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"

namespace retrograde {

struct GradientCheckOptions {
  int directions = 3;                  // of each input
  unsigned seed = 1;                   // of directions and weights
  int smallest_step = 24;              // steps are 2^-4 ... 2^-smallest_step of the input's size
  std::vector<AdjointInput> wrt = {};  // only these inputs are moved; empty: all floating ones
  std::vector<int> mins = {};          // where the output begins; empty: at 0
};

struct GradientReport {
  struct Step {
    double step;                             // relative to the input's size
    double central_error, richardson_error;  // relative, against the adjoint in double
    double seconds;                          // of the two runs of the primal
  };
  // One way to the derivative along the first direction.
  struct Method {
    std::string name;
    double error;    // relative, against the complex step; without one, the adjoint in double
    double seconds;  // without compiling; of the adjoint: of the derivatives by all elements
  };
  struct Input {
    std::string name;
    double adjoint_error = 0;        // adjoint in double against the chosen differences, worst
    double complex_step_error = 0;   // adjoint in double against the complex step, worst
    double dot_product_error = 0;    // adjoint against tangent, both in double, worst
    double own_precision_error = 0;  // adjoint in its own precision against double, worst
    std::vector<Step> steps;         // along the first direction
    std::vector<Method> methods;
  };
  struct FuncError {
    std::string name;
    double error;  // of its adjoint in its own precision, relative to its largest element
    double lost;   // error over that of the worst adjoint that it is computed from
  };

  std::vector<Input> inputs;
  std::vector<FuncError> funcs;      // from the output back to the inputs
  std::string loses_digits;          // the Func whose adjoint adds most to the error; empty: none
  std::string complex_step_refused;  // why there is none; empty when there is
  double worst_error = 0;            // of the errors of adjoints and tangents in double
  double primal_seconds = 0, adjoint_seconds = 0;  // in their own precision, without compiling

  std::string to_json() const;
};

// `sizes`: of the output; none for a scalar. Of a Tuple, all floating values are summed.
// What propagate_adjoints requires, it requires.
// Requires: every input must be bound (RuntimeError); the output needs a size in each of its
// dimensions, and a min in each or none; `wrt` names floating inputs that the output depends on;
// derivatives are of floats (Unsupported); every operation needs a meaning in double (Unsupported).
GradientReport check_gradients(const Func& output, const std::vector<int>& sizes = {},
                               const GradientCheckOptions& options = {});

}  // namespace retrograde
