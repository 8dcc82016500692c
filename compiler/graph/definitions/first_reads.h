// first_reads.h -- which Funcs and images a Func reads.
#pragma once

#include <unordered_map>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

// A call for each Func and image that the definitions of f read, itself included: the first call of each, in the order
// of the walk.
std::vector<const Call*> first_reads(const FuncContents& f);

// While it lives, first_reads() remembers its results in this thread. Each decision of a schedule orders the graph, so
// a schedule asks hundreds of times for each Func, and a definition may have ten thousand nodes. A result is valid as
// long as the Func has the same expressions, so definitions may change meanwhile.
class FirstReadsMemo {
 public:
  FirstReadsMemo();
  ~FirstReadsMemo();
  FirstReadsMemo(const FirstReadsMemo&) = delete;
  FirstReadsMemo& operator=(const FirstReadsMemo&) = delete;

 private:
  friend std::vector<const Call*> first_reads(const FuncContents& f);
  struct Entry {
    std::vector<Expr> roots;  // of all definitions; alive, so that their addresses stay unique
    std::vector<const Call*> reads;
  };
  std::unordered_map<const FuncContents*, Entry> entries_;
  FirstReadsMemo* const outer_;
};

}  // namespace retrograde::graph
