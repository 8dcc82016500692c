// shipped.h -- the weights that come with the program, as it learned them; README.md says how.
#pragma once

#include <vector>

#include "weights.h"

namespace demosaic {

// Of 2, 9 and 15 filters of 5 x 5 and 7 x 7 those that are there.
std::vector<Shape> shipped_shapes();

// "relaxed_9_5.json"
std::string weights_file(const Shape& shape);

// From beside the program, or where it is installed. Throws retrograde::UserError.
Weights shipped_weights(const Shape& shape);

}  // namespace demosaic
