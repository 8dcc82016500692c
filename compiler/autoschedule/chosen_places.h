// chosen_places.h -- which Funcs a user wants to be stored or inlined, by name.
#pragma once

#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "autoschedule/placement_limits.h"
#include "frontend/schedule/autoschedule_options.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct ChosenPlaces {
  std::unordered_set<const Symbol*> store, inlined;
  // Inlined where that can be: see ScheduleRequest.
  std::unordered_set<const Symbol*> recomputed;
};

bool has_chosen_places(const AutoscheduleOptions& options);
// UserError where a name is none of the pipeline's, or a Func cannot be where it is wanted. Funcs with
// a directive keep theirs, whatever the options say.
ChosenPlaces chosen_places(const std::vector<FuncPtr>& outputs, const PlacementLimits& limits,
                           const AutoscheduleOptions& options);
// Those with these names: computed where they are read, unless their bodies get too large.
std::unordered_set<const Symbol*> with_names(const std::vector<FuncPtr>& outputs,
                                             const std::set<std::string>& names);
// The same for what inlining would copy without end.
void check_inlined_bodies(const ChosenPlaces& chosen, const std::vector<FuncPtr>& large);

}  // namespace retrograde::autoschedule
