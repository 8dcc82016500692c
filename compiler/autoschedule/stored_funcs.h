// stored_funcs.h -- which of the Funcs that nobody scheduled are computed at root, not inlined.
//
// Inlining an adjoint into every reader multiplies work: a chain of n stencils with k taps costs
// k^n. So, in a pipeline that contains adjoints, an untouched Func is computed at root when it
// reduces, scatters, or costs more to compute again at its reads (read_estimate.h) than a way to
// memory and back does. That goes for primal Funcs too, which both directions read. A directive of
// the user on a Func or one of its stages switches this off for that Func. Where the user scheduled
// part of the primal, its other pure Funcs stay inline unless that explodes; but a scan, and a
// reduction that is read again and again, is stored: inside of the loops of who reads it, all of it
// would run for each element.
#pragma once

#include <unordered_map>
#include <vector>

#include "autoschedule/chosen_places.h"
#include "autoschedule/fixed_dimensions.h"
#include "autoschedule/placement_limits.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

bool is_differentiated(const std::vector<FuncPtr>& outputs);  // whether an adjoint is among them

// In a pipeline without adjoints, which is left as it is, only what inlining would copy without end
// (large_bodies.h).
std::vector<FuncPtr> stored_by_default(const std::vector<FuncPtr>& outputs,
                                       const ChosenPlaces& chosen = {});
// How often an element of a Func is read, and what it takes to compute it, with what is inlined into
// it.
struct StorageUse {
  double reads = 0;
  double reads_in_all = 0;  // of readers that are inlined, for each time that these are computed
  double alternatives = 1;  // that a read chooses from, where it does not say which
  double operations = 0;
  double share_of_way = 1;  // to memory: narrow values are shorter on it, as they are in vectors
};
std::unordered_map<const Symbol*, StorageUse> uses_of_stored(const std::vector<FuncPtr>& outputs,
                                                             const ChosenPlaces& chosen);
// Where all of the pipeline is to be scheduled: what a user left alone is not meant to be inlined. Nor
// is what chooses along a dimension, `fixed`, where its readers do not say which: see choices.h.
std::vector<FuncPtr> stored_in_all(const std::vector<FuncPtr>& outputs,
                                   const PlacementLimits& limits, const ChosenPlaces& chosen = {},
                                   const FixedDimensions* fixed = nullptr);

}  // namespace retrograde::autoschedule
