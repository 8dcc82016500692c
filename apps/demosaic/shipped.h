// shipped.h -- the learned weights that come with the program; README.md says how they were learned.
#pragma once

#include <vector>

#include "weights.h"

namespace demosaic {

// The network shapes that are installed, out of those with 2, 9 and 15 filters of 5 x 5 and 7 x 7.
std::vector<Shape> shipped_shapes();

// "relaxed_9_5.json"
std::string weights_file(const Shape& shape);

// Read from the program's folder, or where they are installed. Throws retrograde::UserError.
Weights shipped_weights(const Shape& shape);

}  // namespace demosaic
