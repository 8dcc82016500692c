// Funcs that are computed or stored in loops of other Funcs, their hosts, such as the packed rows that register tiles
// read. They move with these loops.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "graph/function.h"

namespace retrograde::transform {

class HostedFuncs {
 public:
  explicit HostedFuncs(const std::vector<FuncPtr>& outputs);

  // Records that something is computed in this loop from now on.
  void add(const FuncContents& host, const std::string& loop) { loops_.insert({host.name, loop}); }

  // Whether something is computed or stored in this loop, or in any loop of the host.
  bool are_in(const FuncContents& host, const std::string& loop) const;
  bool are_in(const FuncContents& host) const;

  std::vector<FuncPtr> computed_in(const FuncContents& host) const;
  // Whether all that is stored in loops of the host is computed in them.
  bool are_computed_where_stored(const FuncContents& host) const;

 private:
  std::vector<FuncPtr> funcs_;
  std::set<std::pair<std::string, std::string>> loops_;  // each with its host
};

}  // namespace retrograde::transform
