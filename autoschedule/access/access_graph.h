// access_graph.h -- who reads and writes what, over which loops.
//
//   rows(x, y) = image(clamp(x - 1, 0, w), y) + image(clamp(x + 1, 0, w), y)
//   bins(hist(r.x)) += 1
//
//   func rows
//     stage 0 (x, y)
//       write rows(x, y)
//       read image(clamped x - 1, y)
//       read image(clamped x + 1, y)
//       1 Add float32 by x, y
//   func bins
//     stage 1 (r.x)
//       write bins(v1)      v1(r.x) = hist(r.x): data decide the place, r.x moves it
//
// The graph is built once from the outputs of a program and never changes. Building it visits each node of the
// definitions once, except those that are equal to ones of an earlier graph. It depends on definitions alone, not on
// directives, except that wrappers are Funcs like others.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "autoschedule/access/index_form.h"
#include "autoschedule/access/stage_id.h"
#include "graph/function.h"

namespace retrograde::planning {

using ImageId = int32_t;

// A loop of a stage without directives: first the pure variables at their own places, then the reduction variables, each
// innermost first.
struct Iterator {
  enum class Kind : uint8_t { Pure, Reduction };
  std::string name;
  Kind kind = Kind::Pure;
  int dimension = -1;  // Pure: of the Func
  Expr min, extent;    // Reduction: over parameters
};

// Conditions under which an access takes place.
struct Congruence {  // form mod modulus == remainder
  IndexForm form;
  int64_t remainder = 0, modulus = 1;
  bool operator==(const Congruence&) const = default;
};
struct Guard {
  std::vector<Congruence> congruences;
  std::vector<IndexForm> nonnegative;  // forms that are at least 0
  std::vector<Value> others;

  bool is_empty() const { return congruences.empty() && nonnegative.empty() && others.empty(); }
  // The fraction of points that the congruences leave, as if these were independent.
  double fraction() const;
  bool operator==(const Guard&) const = default;
};
// The conditions that both have.
Guard intersection(const Guard& a, const Guard& b);

struct Access {
  StageId by;
  FuncId of = -1;  // negative: the image
  ImageId image = -1;
  bool writes = false;
  uint32_t components = 1;  // of a Tuple that are accessed: bit 0 is the first
  std::vector<IndexForm> index;
  // The data-dependent parts of all indices, without their clamps. Equal places have equal numbers.
  Value place;
  Guard guard;  // beside that of the stage; of a select, both arms of which may be evaluated
  std::vector<FuncId> through;  // Funcs that were inlined on the way

  bool same_place(const Access& other) const {
    return of == other.of && image == other.image && index == other.index;
  }
  size_t place_hash() const;  // equal for the same place
  IteratorSet moved_by() const;
};

// How often a stage applies an operator at one point of its loops. Equal values count once.
struct OperationCount {
  std::string name;         // of the kind of node, or of the operator: Add, exp
  Type type;                // of the operands of a comparison; of the result otherwise
  IteratorSet depends = 0;  // the loops that change the value; it is invariant in all others
  int count = 0;
  bool in_arm = false;  // all its uses are in arms of selects that one condition decides
  // A select whose condition these alone decide: copies of the body for each of their points need none.
  IteratorSet decided_by = 0;
};

struct StageNode {
  StageId id;
  std::vector<Iterator> iterators;
  Access write;
  std::vector<Access> reads;  // in the order of the expressions; equal ones once
  Guard guard;                // the predicate
  std::vector<OperationCount> operations;
  std::vector<Expr> definition;  // what it was read from: coordinates, values and predicate
  bool needs_host = false;       // it calls what no kernel can: C functions, print, traced loads
};

struct FuncNode {
  FuncPtr func;
  bool is_output = false;
  std::vector<StageNode> stages;
};

class AccessGraph {
 public:
  AccessGraph() = default;
  // `before`: an earlier graph, or an empty one. Stages that have the same names and definitions there are not read again.
  AccessGraph(const std::vector<FuncPtr>& outputs, AccessGraph before);
  explicit AccessGraph(const std::vector<FuncPtr>& outputs) : AccessGraph(outputs, AccessGraph()) {}

  const std::vector<FuncNode>& funcs() const { return funcs_; }
  const FuncNode& func(FuncId id) const { return funcs_[static_cast<size_t>(id)]; }
  const StageNode& stage(StageId id) const {
    return func(id.func).stages[static_cast<size_t>(id.stage)];
  }
  const std::vector<std::shared_ptr<ParameterContents>>& images() const { return images_; }
  // -1: it is none of the graph.
  FuncId find(const Symbol* func) const;
  FuncId find(const std::string& func) const;
  ImageId find_image(const Symbol* image) const;
  // The stages of other Funcs that read it, each once.
  const std::vector<StageId>& consumers(FuncId id) const {
    return consumers_[static_cast<size_t>(id)];
  }
  // Values with the numbers of this graph, for accesses that are derived from its own.
  const ValueNumbers& numbers() const { return numbers_; }
  // The number of visits to nodes of expressions: a measure of the time that building takes, for tests.
  size_t nodes_visited() const { return nodes_visited_; }

 private:
  std::vector<FuncNode> funcs_;
  std::vector<std::shared_ptr<ParameterContents>> images_;
  std::unordered_map<const Symbol*, FuncId> ids_;
  std::unordered_map<std::string, FuncId> ids_by_name_;
  std::unordered_map<const Symbol*, ImageId> image_ids_;
  std::vector<std::vector<StageId>> consumers_;
  ValueNumbers numbers_;
  size_t nodes_visited_ = 0;

  StageNode read_stage(StageId id, AccessGraph& before);
  bool renumber(StageNode& stage, StageId id, const AccessGraph& before) const;
};

std::string print(const AccessGraph& graph);
std::string print(const AccessGraph& graph, const Access& access);

}  // namespace retrograde::planning
