// explain.h -- explains what a run computes, and what it leaves out because nothing needs it.
#pragma once

#include <string>
#include <vector>

#include "groups.h"
#include "shape.h"

namespace bilateral_slice {

// One line for each thing left out.
std::vector<std::string> left_out(const Shape& shape, const Groups& moves);

// --explain: prints the grid, the gradient and what is left out.
void explain(const Shape& shape, const Groups& moves);

}  // namespace bilateral_slice
