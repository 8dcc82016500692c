// stage_reader.h -- reads the accesses of one stage from its expressions. Each node is visited a fixed number of times.
#pragma once

#include <map>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "analysis/bounds_engine.h"
#include "autoschedule/access/access_graph.h"
#include "ir/node_memo.h"

namespace retrograde::planning {

// The Funcs and images of a graph.
struct Names {
  const std::unordered_map<const Symbol*, FuncId>& funcs;
  const std::unordered_map<const Symbol*, ImageId>& images;
};

// The values and index forms of a stage's expressions, which contain no lets.
class StageValues {
 public:
  StageValues(Names names, ValueNumbers& numbers, const std::vector<Iterator>& iterators);

  Value value(const Expr& e);
  // The same, with the clamps of indices stripped: adjoints clamp what the primal doesn't.
  Value place(const Expr& e);
  IndexForm form(const Expr& e);
  // The form with its range, as an index of an access.
  IndexForm index(const Expr& e);
  size_t nodes_visited() const { return nodes_; }

 private:
  using Part = Value (StageValues::*)(const Expr& e);
  Value find_value(const Expr& e, Part part);
  Value call_value(const Call& call, Part part);
  Value find_place(const Expr& e);
  IndexForm find_form(const Expr& e);
  std::optional<IndexForm> binary_form(const Expr& e, const Binary& binary);
  IndexForm sum_form(const Expr& a, const Expr& b, int64_t factor);
  std::optional<IndexForm> extreme_form(const Expr& e, const Binary& binary);
  std::optional<IndexForm> select_form(const Select& select);
  IndexForm opaque(const Expr& e);
  IndexForm clamped(IndexForm form, const Expr& clamp);

  const Names names_;
  ValueNumbers& numbers_;
  std::unordered_map<std::string, int> iterators_;
  analysis::Scope<Interval> scope_;
  analysis::BoundsEngine bounds_;
  NodeMemo<Value> values_, places_;
  NodeMemo<IndexForm> forms_;
  size_t nodes_ = 0;
};

class StageReader {
 public:
  StageReader(Names names, ValueNumbers& numbers, const FuncContents& f, StageId id);
  StageNode read();
  size_t nodes_visited() const { return values_.nodes_visited() + nodes_; }

 private:
  void read_extern(StageNode& node);
  void read_call(const Call& call, const Guard& guard);
  void read_access(const Call& call, const Guard& guard);
  void count_operations(StageNode& node);
  void count(const Expr& e);
  bool count_interior(const Expr& e);
  std::vector<IndexForm> indices(const std::vector<Expr>& args);
  Value place_of(const std::vector<IndexForm>& index);

  const Names names_;
  ValueNumbers& numbers_;
  const FuncContents& f_;
  const Definition& definition_;
  const StageId id_;
  std::vector<Iterator> iterators_;
  StageValues values_;
  std::vector<Expr> args_, stored_;  // stored: values and predicate
  std::vector<Access> reads_;
  bool needs_host_ = false;
  std::unordered_map<size_t, std::vector<size_t>> reads_by_hash_;
  std::unordered_set<const ir::ExprNode*> counted_nodes_, in_arms_;
  std::map<std::pair<std::string, Value>, OperationCount> counted_;
  size_t nodes_ = 0;
};

// The loops and the expressions of a definition.
std::vector<Iterator> iterators_of(const FuncContents& f, const Definition& definition);
std::vector<Expr> expressions_of(const Definition& definition);
// Whether the arm of a select, or the operand of a minimum or maximum, is the one inside of the border.
bool is_likely(const Expr& e);

// ---- guards.cpp ----

// The guard of a conjunction.
Guard guard_of(const Expr& condition, bool is_true, StageValues& values);

// Visits the calls of the expressions in the order of the text, each with the conditions of the selects around it: those
// around all of its uses.
void for_each_guarded_call(const std::vector<Expr>& roots, StageValues& values, size_t& nodes,
                           ir::FunctionRef<void(const Call&, const Guard&)> visit);

}  // namespace retrograde::planning
