// groups.h -- the groups of a look's parameters, and which of them a run optimizes ("moves").
#pragma once

namespace bilateral_slice {

// A group that does not move has no adjoint, no moments and no Adam step in the pipeline.
struct Groups {
  bool grid = true, mix = true, curve = true;

  bool guide() const { return mix || curve; }
  bool all() const { return grid && mix && curve; }
};

}  // namespace bilateral_slice
