// regions.h -- the region of every Func that a region of the outputs needs: the domain over which adjoints sum.
#pragma once

#include <map>
#include <set>
#include <unordered_map>
#include <vector>

#include "analysis/interval.h"
#include "autodiff/inversion/access_inversion.h"
#include "frontend/language/rdom.h"
#include "graph/function.h"

namespace retrograde::autodiff {

class Regions {
 public:
  // `order` has producers before consumers and ends with the output, whose region is `output`.
  Regions(const std::vector<FuncPtr>& order, const Box& output);
  // The same for several outputs, anywhere in the order.
  Regions(const std::vector<FuncPtr>& order, const std::map<const Symbol*, Box>& outputs);

  // Adds a Func with its region, and all that it reads.
  void add(const FuncPtr& f, const Box& box);
  // The elements of a Func or image that are read or computed. Undefined ends are unbounded; an empty Box means never
  // read.
  const Box& of(const Symbol* symbol) const;
  // The variables of a stage with their ranges: pure variables, then reduction variables, innermost first.
  IterationDomain domain(const FuncContents& f, int stage) const;
  std::vector<LoopVariable> loop_variables(const Symbol* symbol,
                                           const std::vector<std::string>& names) const;

 private:
  void add_func(const FuncPtr& f);
  void add_extern_arguments(const FuncContents& f);
  void grow(const Symbol* symbol, const Box& box);
  std::unordered_map<const Symbol*, Box> boxes_;
  std::set<const Symbol*> outputs_;
};

// Converts a region, min and extent, to the min and max of each dimension.
Box box_of(const Region& region);

}  // namespace retrograde::autodiff
