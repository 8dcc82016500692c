// motion.h -- how far data-dependent indices move from one iteration to the next.
//
//   image(cast<int>(x + flow(x, y)), y)      moves with x, and a little with the values of flow
//   image(cast<int>(a * x + b * y), y)       moves with x and y, nobody knows how far
//   table(places(x))                         goes anywhere
//
// It decides how many cache lines a vector of a gather touches, and whether the next row touches them again.
#pragma once

#include <optional>
#include <unordered_map>
#include <vector>

#include "autoschedule/access/access_graph.h"

namespace retrograde::planning {

struct Motion {
  bool is_table = false;                      // values from an array of integers
  std::vector<std::optional<double>> slopes;  // by iterator; nullopt: unknown

  bool operator==(const Motion&) const = default;
};

class Motions {
 public:
  explicit Motions(const AccessGraph& graph);
  // The slopes are those of the value's iterators, in their order. A value that is no part of an index as the program
  // writes it has none.
  const Motion* of(const Value& value) const { return ir::find_or_null(by_number_, value.number); }

 private:
  using Names = std::unordered_map<std::string, size_t>;
  using Known = std::unordered_map<const ir::ExprNode*, Motion>;

  Motion of(const Expr& e, const Names& iterators, Known& known);
  Motion find(const Expr& e, const Names& iterators, Known& known);
  Motion of_call(const Call& call, const Names& iterators, Known& known);
  const Motion& of_func(FuncId func, size_t component);

  const AccessGraph& graph_;
  std::unordered_map<uint32_t, Motion> by_number_;
  std::unordered_map<uint64_t, Motion> funcs_;  // by Func and component: along its dimensions
};

}  // namespace retrograde::planning
