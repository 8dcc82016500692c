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

// Composes the reads of single stages, for any choice of inlined Funcs.
class ReadComposer {
 public:
  struct Composed {
    std::vector<Access> reads;  // of Funcs and images that are not inlined
    // The elements of inlined Funcs that a point of the stage computes.
    std::map<FuncId, std::vector<Access>> elements;
    bool is_complete = true;  // not beyond the limit
  };
  // A stage composes no more than `most_reads` reads.
  ReadComposer(const AccessGraph& graph, size_t most_reads);
  // `is_inlined`: pure Funcs that are no outputs.
  Composed compose(const StageNode& stage, ir::FunctionRef<bool(FuncId)> is_inlined);

 private:
  Access compose(const Access& inner, const Access& outer);
  IndexForm compose(const IndexForm& inner, const Access& outer);
  std::optional<IndexForm> compose_parts(const IndexForm& inner, const Access& outer);
  Value compose(const Value& inner, const Access& outer);
  Guard compose(const Guard& inner, const Access& outer);
  Value value_of(const IndexForm& form);

  const AccessGraph& graph_;
  const size_t most_reads_;
  ValueNumbers numbers_;
};

// Those of all stages.
class ComposedReads {
 public:
  // `inlined`, by Func.
  ComposedReads(const AccessGraph& graph, const std::vector<bool>& inlined, size_t most_reads);

  const std::vector<Access>& of(StageId stage) const { return found_.at(stage).reads; }
  bool is_complete(StageId stage) const { return found_.at(stage).is_complete; }
  // How many elements of an inlined Func a point of the stage computes.
  size_t elements_of(StageId stage, FuncId inlined) const;

 private:
  std::map<StageId, ReadComposer::Composed> found_;
};

}  // namespace retrograde::planning
