// steady_state.h -- finds the iterations of a loop in which its likely() conditions hold, and what a separate loop for
// them saves. Used by partition_loops.
#pragma once

#include <string>
#include <unordered_map>
#include <unordered_set>

#include "analysis/interval.h"
#include "ir/expr.h"
#include "ir/markers.h"
#include "ir/visit.h"

namespace retrograde::lower {

bool is_likely(const Call* call);
bool is_serial(
    const For&
        loop);  // serial or parallel: an iteration is not a lane, a copy or a thread of a block

// Above this number of nodes a second copy of the body costs more than a branch in each iteration.
inline constexpr int costly_border = 200;
// Above this number of nodes the copy of the body for the borders is not partitioned further.
inline constexpr int small_body = 1500;
int node_count(const Stmt& s);

// Names that a solution may not mention, with the values of lets and the ranges of loop variables.
class PartitionContext {
 public:
  void add_let(const std::string& name, const Expr& value);
  void add_range(const std::string& name, const Interval& range) { ranges_.push(name, range); }
  void add_loop(const For& loop);
  // The expression with lets substituted and likely markers removed.
  Expr expand(const Expr& e) const { return without_likely(substitute(e, lets_)); }
  const Scope<Interval>& ranges() const { return ranges_; }

 private:
  Substitution lets_;
  Scope<Interval> ranges_;
};

// How much a separate loop for the steady state saves.
//
// A condition outside of all inner loops, or one that does not change in an inner serial loop, is evaluated once per
// inner loop: nothing is saved. A condition over the lanes of a vector turns gathers into dense loads and removes
// selects: it pays unless the body is very large in comparison. Other conditions, such as the min of a shifted tile or
// a clamp of scalars, save one or two operations per iteration. They may also show that the start of a vector is a
// multiple of some constant, which simplifies divisions in the body.
struct Saving {
  bool always_pays = false;
  int over_lanes = 0;
  int operations = 0;
  bool divides = false;
};

// The steady state of one loop.
struct SteadyState {
  Interval range;                 // of the loop variable
  Expr needed;                    // a further condition for the steady state; undefined: none
  bool has_thick_border = false;  // an iteration of the border may contain a tile or more
  bool has_warm_up =
      false;  // only the first iteration decides differently, independent of inner loops
  int solved = 0;
  Saving saving;
};

// Rewrites the body of a loop for its steady state, and finds the range of that state.
class SteadyRewriter : public Rewriter {
 public:
  SteadyRewriter(const For& loop, const PartitionContext& outer, bool inside_lanes);
  const SteadyState& steady() const { return steady_; }

 protected:
  Expr rewrite(const Expr& e) override;
  Stmt rewrite(const Stmt& s) override;

 private:
  // Ordered by precedence.
  enum class Mark : uint8_t { None, Decided, Likely };

  Expr rewrite_let(const Expr& e, const Let& n);
  Expr bind(const std::string& name, const Expr& original);
  Stmt rewrite_loop(const Stmt& s, const For& n);
  bool decides_alone(const For& n, int64_t extent) const;
  Expr rewrite_extreme(const Binary& n, const Expr& copy);
  Expr rewrite_select(const Select& n, const Expr& copy);
  bool is_mark(const Call& call) const { return call.is_op(Op::likely) || inner_serial_.empty(); }
  Mark mark(const Expr& e);
  bool holds(const Expr& condition, bool is_true, bool is_choice);
  bool is_about_tiles(const std::unordered_set<std::string>& names) const;
  bool is_warm_up(const Interval& steady, const std::unordered_set<std::string>& names) const;
  void count_saving(const std::unordered_set<std::string>& names, bool is_choice);

  const For& loop_;
  PartitionContext context_;
  const bool inside_lanes_;
  const bool has_inner_loops_, has_costly_rows_, partitions_borders_;
  SteadyState steady_;
  std::unordered_set<std::string>
      dependent_;  // the loop's variable, and those of inner loops whose minimum depends on it
  std::unordered_set<std::string> inner_serial_, lanes_, of_unknown_extent_;
  std::unordered_set<std::string>
      decide_alone_;                    // inner serial loops that partition on their own conditions
  std::vector<std::string> enclosing_;  // inner serial loops around the current node
  std::unordered_map<std::string, int64_t> inner_extents_;  // constant ones
  std::unordered_map<std::string, Mark> marked_lets_;
  std::unordered_map<std::string, Expr> decided_lets_;
  std::unordered_map<const ExprNode*, Mark>
      marks_;  // by node of the body, which outlives this object
};

}  // namespace retrograde::lower
