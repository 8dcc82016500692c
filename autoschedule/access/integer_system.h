// integer_system.h -- linear conditions on integers: narrows the ranges of the variables, and proves that some systems
// have no solution.
//
//   4 x + y = 0,  y in [0, 3]          x and y are 0
//   i = 2 p,  i + 1 = 2 q              no solution
//
// Method: equations cancel variables in the other conditions; then each condition narrows the range of each of its
// variables until nothing changes, and remainders are compared. It is sound and incomplete: analysis/never_meet.h decides
// such systems exactly, and takes a thousand times as long.
#pragma once

#include <cstdint>
#include <vector>

#include "ir/interval.h"

namespace retrograde::planning {

class IntegerSystem {
 public:
  struct Term {
    int variable = 0;
    int64_t coefficient = 1;
  };

  int add_variable(const ir::ConstantRange& range = {});
  // The sum of the terms and of a constant in the range is 0. A variable occurs once.
  void add_condition(const std::vector<Term>& sum, const ir::ConstantRange& constant);
  void restrict(int variable, const ir::ConstantRange& range);

  // Adds the conditions after variables have been cancelled by equations; the first `kept` ones last.
  void combine_equations(int kept);
  // Narrows the ranges. False: there is no solution.
  bool narrow();
  int variables() const { return static_cast<int>(ranges_.size()); }
  const ir::ConstantRange& range(int variable) const {
    return ranges_[static_cast<size_t>(variable)];
  }

 private:
  struct Condition {
    std::vector<Term> sum;
    ir::ConstantRange constant;
  };
  bool narrow(const Condition& condition, bool& has_changed);
  bool has_fitting_remainder(const Condition& condition) const;

  std::vector<ir::ConstantRange> ranges_;
  std::vector<Condition> conditions_;
};

}  // namespace retrograde::planning
