// split_update.h -- one update whose terms are split over new Funcs of partial results.
//
//   s() += e(r)     split r by 16, inside "lane"     s() += e(16 r + lane)
//                   factor lane                      lanes(l) += e(16 r + l);  s() += lanes(lane)
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "graph/function.h"

namespace retrograde::planning {

class SplitUpdate {
 public:
  SplitUpdate(const graph::FuncPtr& f, int stage) : f_(f), stage_(stage) {}

  // Splits a loop; what is left outside keeps the name. The result: the name of the loop inside.
  std::string split(const std::string& loop, const std::string& inner, int64_t factor) const;
  // The same, but what is left inside keeps the name. The result: the name of the loop outside.
  std::string split_outside(const std::string& loop, const std::string& outer,
                            int64_t factor) const;
  // Two loops that run as one; the result is its name.
  std::string fuse(const std::string& inner, const std::string& outer) const;
  // Partial results for each iteration of these loops, which become variables with the given names. The result: the Func of
  // partial results.
  graph::FuncPtr factor(const std::vector<std::pair<std::string, std::string>>& loops);
  // Leaves the definitions alone.
  void finish() const;

 private:
  const graph::FuncPtr f_;
  const int stage_;
  std::vector<graph::FuncPtr> made_;

  std::string new_name(std::string wanted) const;
  std::string split(const std::string& loop, const std::string& outer, const std::string& inner,
                    int64_t factor, const std::string& result) const;
};

}  // namespace retrograde::planning
