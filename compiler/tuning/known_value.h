// known_value.h -- what is known of a value inside a loop nest without running it.
//
// Loops run over numbers: each value is taken in the middle of all loops around it, with its slope along
// each of them, its range, and how it goes from lane to lane. A place that data decide is where it would
// be if the data were zero: displacements are small beside what they displace, so that x + flow(x) moves
// along with x. Every value has a number: two of one number are equal, so that a sum of equal
// operations can be taken once.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "ir/expr.h"
#include "ir/node_memo.h"
#include "tuning/program_sizes.h"

namespace retrograde::tuning {

// From lane to lane: runs of `inner` lanes with one step, and a step from run to run.
struct Lanes {
  int count = 1, inner = 1;
  double step = 0, outer_step = 0;
  bool any = false;   // any lanes, as data have them
  bool bent = false;  // the step changes on the way, as a clamped coordinate's does
  bool is_uniform() const { return !any && step == 0 && outer_step == 0; }
};

struct KnownValue {
  double at = 0;               // in the middle of all loops; of a condition: how often it holds
  double low = 0, high = 0;    // of all iterations
  std::vector<double> slopes;  // by the place of a loop in the nest: from one iteration to the next
  uint64_t depends = 0;        // bits of the places of loops
  bool from_data = false;
  Lanes lanes;
  uint64_t number = 0;

  double slope(size_t place) const { return place < slopes.size() ? slopes[place] : 0; }
  int deepest() const;  // place of the innermost loop that it depends on; -1: none
  bool is_constant() const { return depends == 0 && !from_data; }
};

inline constexpr double unbounded = 1e30;

class KnownValues {
 public:
  explicit KnownValues(const ProgramSizes& sizes) : sizes_(sizes) {}

  KnownValue of(const Expr& e);
  void bind(const std::string& name, KnownValue value);
  // The next loop inward, or a place of another kind, over [min, min + trips).
  void enter(const std::string& loop, const KnownValue& min, double trips,
             std::unordered_set<std::string> stored);
  void leave();
  size_t places() const { return stored_.size(); }

 private:
  const ProgramSizes& sizes_;
  std::unordered_map<std::string, KnownValue> bound_;
  std::vector<std::unordered_set<std::string>> stored_;  // in each place
  std::unordered_map<const ir::ExprNode*, std::pair<Expr, KnownValue>> memo_;
  uint64_t next_ = 1;  // of loops

  KnownValue find_out(const Expr& e);
  KnownValue variable_value(const Variable& v);
  KnownValue load_value(const Load& load);
  KnownValue call_value(const Call& call);
  KnownValue let_value(const Let& let);
};

}  // namespace retrograde::tuning
