// inputs.h -- the inputs of an interpreted pipeline: the values of its parameters, and the elements of its images.
#pragma once

#include <map>

#include "graph/function.h"
#include "testing/interpreter/points.h"
#include "testing/tracked_value.h"

namespace retrograde::oracle {

class Inputs {
 public:
  // Requires: the parameter has a value.
  static Value value_of(const graph::ParameterContents& parameter);
  // The min, extent or stride that the variable names: "in.extent.1".
  static Value metadata(const graph::ParameterContents& image, const ir::Variable& variable);
  // Requires: the image has a host buffer that holds the point.
  Value read(const graph::ParameterContents& image, const Point& point);
  // The smallest box around the elements that were read so far.
  Region touched(const graph::ParameterContents& image) const;

 private:
  std::map<const graph::ParameterContents*, Hull> touched_;
};

}  // namespace retrograde::oracle
