// motion.h -- how far data-dependent indices move from one iteration to the next.
//
//   image(cast<int>(x + flow(x, y)), y)      moves with x, and a little with the values of flow
//   image(cast<int>(a * x + b * y), y)       moves with x and y, nobody knows how far
//   table(places(x))                         goes anywhere
//
// It decides how many cache lines a vector of a gather touches, and whether the next row touches them again.
#pragma once

#include <unordered_map>
#include <vector>

#include "autoschedule/access/access_graph.h"

namespace retrograde::planning {

struct Motion {
  bool is_table = false;       // values from an array of integers
  std::vector<double> slopes;  // by iterator; NaN: unknown
  double period = 0;           // of a remainder, such as (x + 1) % 2: it wraps there; 0: nowhere
};

class Motions {
 public:
  explicit Motions(const AccessGraph& graph);
  // The slopes are those of the value's iterators, in their order. A value that is no part of an index as the program
  // writes it has none.
  const Motion* of(const Value& value) const { return ir::find_or_null(by_number_, value.number); }

 private:
  // The iterators of the expressions that are read, and what is known of these.
  struct Scope {
    std::unordered_map<std::string, size_t> iterators;
    std::unordered_map<const ir::ExprNode*, Motion> known;
  };
  const AccessGraph& graph_;
  std::unordered_map<uint32_t, Motion> by_number_;
  std::unordered_map<uint64_t, Motion> funcs_;  // by Func and component: along its dimensions

  void note(const Access& access, Scope& scope);
  Motion of(const Expr& e, Scope& scope);
  Motion find(const Expr& e, Scope& scope);
  Motion of_call(const Call& call, Scope& scope);
  const Motion& of_func(FuncId func, size_t component);
};

}  // namespace retrograde::planning
