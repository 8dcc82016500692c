// groups.h -- the groups of a look's parameters, and which of them a run moves.
#pragma once

namespace bilateral_slice {

// For a group that stays, no adjoint, no moments and no step of Adam are built.
struct Groups {
  bool grid = true, mix = true, curve = true;

  bool guide() const { return mix || curve; }
  bool all() const { return grid && mix && curve; }
};

}  // namespace bilateral_slice
