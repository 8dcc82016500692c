// coarse_axis.h -- how the expressions of a stage depend on one of its variables, if they read a grid that is much
// coarser than the stage: through an index of the grid, such as y / 32 + 1, or otherwise.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/interval.h"
#include "ir/expr.h"
#include "ir/node_memo.h"

namespace retrograde::transform {

// The ranges of the variables of a stage, with constant ends; an undefined end is not known.
using VariableRanges = std::map<std::string, Interval>;

class CoarseAxis {
 public:
  // `variable`: one of the pure variables of a stage.
  CoarseAxis(std::string variable, const std::vector<std::string>& pure,
             const VariableRanges& ranges);

  struct Dependence {
    bool is_fine = false;  // other than through one index of grids
    Expr index;            // through this one; undefined: not at all
    bool is_through_index() const { return !is_fine && index.defined(); }
  };
  Dependence of(const Expr& e);

  // The values of the index.
  Interval range_of(const Expr& index) const;
  // An expression that depends on the variable through `index`, as one of the coordinate in the grid. The coordinate
  // has the variable's name.
  Expr over_grid(const Expr& e, const Expr& index) const;
  const std::string& variable() const { return variable_; }

 private:
  bool is_index(const Expr& e);
  Dependence of_call(const Call& call);

  const std::string variable_;
  const std::vector<std::string>& pure_;
  const VariableRanges& ranges_;
  ir::NodeMemo<Dependence> known_;
};

// The extent, if it is known.
std::optional<double> extent_of(const Interval& range);
bool is_element_read(const Expr& e);

}  // namespace retrograde::transform
