// The interface between the test of access patterns and the two languages that differentiate them.
#pragma once

#include <string>
#include <vector>

namespace access_table {

// How one update of an adjoint accumulates its sums.
struct UpdateShape {
  bool is_gather =
      true;             // no index on its left-hand side runs over its reduction or depends on data
  long iterations = 1;  // iterations of its reduction domain for each element; -1: parametric
};

struct Outcome {
  std::string error;  // empty: there is a gradient
  std::vector<UpdateShape> updates;
  std::vector<float> gradient;  // the adjoint of the input, dimension 0 innermost

  bool is_gather() const {
    for (const UpdateShape& u : updates) {
      if (!u.is_gather) return false;
    }
    return error.empty();
  }
};

// The class of an access in the terms of integer set analysis.
enum class Nature {
  QuasiAffine,   // piecewise affine with floors of constants: a gather exists
  Determined,    // data, but only of variables that the other indices determine: a gather exists
  DataDependent  // data-dependent indices: a scatter, inside the determined dimensions
};

struct Description {
  std::string name;
  Nature nature;
  std::vector<int> input, output;  // extents; all dimensions start at 0
};
std::vector<Description> descriptions();

// The adjoint of the input. The seed at the i-th element of the output is (37 i + 11) % 17 - 8.
Outcome differentiate_in_halide(size_t pattern);
Outcome differentiate_in_retrograde(size_t pattern);

// The same gradient without differentiation. Every pattern is linear in its input, so one evaluation of the pipeline on
// each unit vector gives a column of its matrix.
std::vector<float> gradient_by_columns(size_t pattern);

}  // namespace access_table
