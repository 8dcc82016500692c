// compose.h -- what stages read through the Funcs that are inlined into them.
//
//   blur(x) = f(x - 1) + f(x) + f(x + 1);   out(x) = blur(2 * x) + blur(2 * x + 1)
//
// If blur is inlined, out reads f(2 * x - 1), f(2 * x), f(2 * x + 1) and f(2 * x + 2). Indices are composed as forms, so
// no expression is walked or built. Equal reads become one, which bounds the number of reads of a chain of stencils.
#pragma once

#include <map>
#include <vector>

#include "autoschedule/access/access_graph.h"

namespace retrograde::planning {

class ComposedReads {
 public:
  // `inlined`, by Func: pure Funcs that are no outputs. A stage composes no more than `most_reads` reads.
  ComposedReads(const AccessGraph& graph, const std::vector<bool>& inlined, size_t most_reads);

  // The reads of Funcs and images that are not inlined.
  const std::vector<Access>& of(StageId stage) const { return found_.at(stage).reads; }
  // Whether these are all: not beyond the limit.
  bool is_complete(StageId stage) const { return found_.at(stage).is_complete; }
  // How many elements of an inlined Func a point of the stage computes.
  size_t elements_of(StageId stage, FuncId inlined) const;

 private:
  struct Found {
    std::vector<Access> reads;
    std::map<FuncId, size_t> elements;
    bool is_complete = true;
  };
  Found compose(const StageNode& stage, size_t most_reads);
  Access compose(const Access& inner, const Access& outer);
  IndexForm compose(const IndexForm& inner, const Access& outer);
  std::optional<IndexForm> compose_parts(const IndexForm& inner, const Access& outer);
  Value compose(const Value& inner, const Access& outer);
  Guard compose(const Guard& inner, const Access& outer);
  Value value_of(const IndexForm& form);

  const AccessGraph& graph_;
  const std::vector<bool> inlined_;
  ValueNumbers numbers_;
  std::map<StageId, Found> found_;
};

}  // namespace retrograde::planning
