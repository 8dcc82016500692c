// slopes.h -- the derivative of a weighted output along a direction of one input, in double, without
// differentiation: by central differences and by a complex step.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "checks/arrays.h"
#include "checks/check_gradients.h"
#include "checks/complex_step.h"
#include "checks/timed.h"

namespace retrograde::checks {

class Slopes {
 public:
  // `output`: in double, with its inputs bound. `weights`: one array for each value of the output; empty
  // for integers.
  Slopes(const Func& output, const Shape& shape, const std::vector<Values>& weights,
         const std::vector<Input>& inputs);

  // The best estimate from differences with steps from 2^-4 to 2^-smallest_step of the input's size; the
  // time includes all of them. `steps` (may be null) receives their errors against `adjoint`.
  Timed<double> by_differences(Input& input, const Values& v, int smallest_step, double adjoint,
                               double scale, std::vector<GradientReport::Step>* steps);
  // Why there is no complex step; empty if there is one.
  const std::string& complex_step_refused() const { return complex_.refused; }
  Timed<double> by_complex_step(const Input& input, const Values& v);

 private:
  struct Difference {
    double central, seconds;
  };
  Difference central(Input& input, const Values& v, double h);
  void bind_imaginary(const Input& input);

  Shape shape_;
  std::vector<Values> weights_;
  Func primal_;
  ComplexGraph complex_;
  Func complex_primal_;
  std::map<const ir::Symbol*, Input> imaginary_;  // by the input's parameter in double
};

}  // namespace retrograde::checks
