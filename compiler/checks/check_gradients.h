// check_gradients.h -- checks the gradient of a pipeline against finite differences, tangents and the complex step.
//
// Func loss; ...; photo.set(buffer);                 // every input bound
// GradientReport report = check_gradients(loss);
// EXPECT_LT(report.worst_error, 1e-7);
// std::ofstream("report.json") << report.to_json();  // tools/plot_report draws it
//
// The output (over `sizes`, from `mins`) is summed with random weights w. For random directions v of each
// floating-point input the check computes in double: the adjoint <v, J^T w>, the tangent <J v, w>, central differences
// over steps of many sizes with Richardson extrapolation, and a complex step if the program allows it
// (checks/complex_step.h). The step of the differences is the one where two neighbouring extrapolations agree best. The
// adjoint in its own precision is then compared with the adjoint in double, Func by Func.
#pragma once

#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"

namespace retrograde {

struct GradientCheckOptions {
  int directions = 3;      // number of random directions for each input
  unsigned seed = 1;       // random seed of directions and weights
  int smallest_step = 24;  // steps are 2^-4 ... 2^-smallest_step of the input's size
  std::vector<AdjointInput> wrt =
      {};                      // only these inputs are moved; empty: all floating-point inputs
  std::vector<int> mins = {};  // where the output begins; empty: at 0
};

struct GradientReport {
  struct Step {
    double step;                             // relative to the input's size
    double central_error, richardson_error;  // relative, against the adjoint in double
    double seconds;                          // time of the two runs of the primal
  };
  // One method that computes the derivative along the first direction.
  struct Method {
    std::string name;
    double error;    // relative, against the complex step or, without one, the adjoint in double
    double seconds;  // without compilation; for the adjoint: derivatives by all elements
  };
  struct Input {
    std::string name;
    double adjoint_error = 0;        // adjoint in double against the chosen differences, worst
    double complex_step_error = 0;   // adjoint in double against the complex step, worst
    double dot_product_error = 0;    // adjoint against tangent, both in double, worst
    double own_precision_error = 0;  // adjoint in its own precision against double, worst
    std::vector<Step> steps;         // of the differences along the first direction
    std::vector<Method> methods;
  };
  struct FuncError {
    std::string name;
    double error;  // error of its adjoint in its own precision, relative to its largest element
    double lost;   // the error, divided by that of the worst adjoint that it is computed from
  };

  std::vector<Input> inputs;
  std::vector<FuncError> funcs;      // from the output back to the inputs
  std::string loses_digits;          // the Func whose adjoint adds most to the error, or empty
  std::string complex_step_refused;  // reason if there is no complex step; else empty
  double worst_error = 0;            // worst error of adjoints and tangents in double
  double primal_seconds = 0, adjoint_seconds = 0;  // in their own precision, without compilation

  std::string to_json() const;
};

// `sizes` are those of the output; none for a scalar. For a Tuple, all floating-point values are summed. All
// requirements of propagate_adjoints apply.
// Requires: every input must be bound (RuntimeError); the output needs a size in each of its
// dimensions, and a min in each or none; `wrt` names floating inputs that the output depends on;
// derivatives are of floats (Unsupported); every operation needs a meaning in double (Unsupported).
GradientReport check_gradients(const Func& output, const std::vector<int>& sizes = {},
                               const GradientCheckOptions& options = {});

}  // namespace retrograde
