// fit_machine.h -- figures of a machine, corrected by how long programs took.
//
//   fit_machine(machine, samples).machine     the same with each kind of figure times a factor
//
// Few factors for all programs: one for each term of a prediction. They make the sum of squares of
// log(predicted / measured) least, held near 1 where the samples do not say, and within bounds.
// Method: Gauss-Newton with damping (D. Marquardt, SIAM J. Appl. Math. 11, 1963), on the logarithms of
// the factors, derivatives by differences. The same samples give the same factors.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "autoschedule/machine/machine.h"

namespace retrograde::tuning {

struct FitSample {
  std::function<double(const planning::Machine&)> predict;  // seconds
  double measured_seconds = 0;
};

struct FittedTerm {
  std::string name;
  double factor = 1;
};

struct MachineFit {
  planning::Machine machine;
  std::vector<FittedTerm> terms;
  double error_before = 0, error_after = 0;  // see fit_error
};

MachineFit fit_machine(const planning::Machine& start, const std::vector<FitSample>& samples);

// By what factor a prediction is wrong: 1 is exact. The root of the mean square, on a logarithmic scale.
double fit_error(const planning::Machine& machine, const std::vector<FitSample>& samples);

}  // namespace retrograde::tuning
