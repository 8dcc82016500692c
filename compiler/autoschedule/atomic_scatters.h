// atomic_scatters.h -- sums at places that data decide, by atomic updates, where bits may differ from
// run to run (AutoscheduleOptions::deterministic = false).
//
// Private parts live one for each thread, not all at once, where all take more memory than the budget
// allows: each is added to the sum as soon as it is full.
//
//   parallel part: for r: parts(i(r), part) += ...     parallel part:
//   parallel x: for part: sum(x) += parts(x, part)  =>   for r: parts(i(r)) += ...
//                                                        for x: atomic: sum(x) += parts(x)
//
// A large scatter without parts or any dimension of its own, which would run in one thread:
//
//   for r: f(i(r)) += term(r)    =>    parallel r: atomic: f(i(r)) += term(r)
//
// The adds of the first are one for each element of each part, some nanoseconds each: it takes two or
// three times as long, and parts that the caches hold are left. Those of the second are one for each
// iteration, as without: it gains as long as threads seldom meet, so that the sum has to be large.
#pragma once

#include <unordered_map>
#include <vector>

#include "autoschedule/default_schedule.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

class AtomicScatters {
 public:
  // Of the stored Funcs that nobody scheduled; `but`: none of these. Nothing where the request wants
  // the same bits each time, or one thread.
  AtomicScatters(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                 const std::unordered_set<const Symbol*>& but, const ScheduleRequest& request,
                 const SizeEstimate& sizes);
  // Of private parts: that all of its loops are to be serial.
  bool is_part(const FuncContents& f) const { return parts_.contains(&f); }
  // All loops of a Func that is computed at root; false: it is none of these.
  bool schedule(const FuncPtr& f) const;

 private:
  bool is_large_scatter(const FuncContents& f, const Definition& update) const;

  bool is_on_ = false;
  const SizeEstimate& sizes_;
  std::unordered_set<const Symbol*> parts_;
  std::unordered_map<const Symbol*, FuncPtr> parts_of_;  // by the sum
};

}  // namespace retrograde::autoschedule
