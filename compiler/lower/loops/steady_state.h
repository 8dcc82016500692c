// steady_state.h -- the part of a loop in which its likely() conditions hold, and what they are
// worth there. Used by partition_loops.
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
bool is_serial(const For& loop);  // or parallel: it runs one iteration after the other

// A copy of a body with more nodes costs more than a branch in each iteration.
inline constexpr int costly_border = 200;
// The copy for the borders of a body with more nodes is not partitioned further.
inline constexpr int small_body = 1500;
int node_count(const Stmt& s);

// Names whose values a solution may not mention: what a let stands for, and between what a loop
// variable lies.
class PartitionContext {
 public:
  void add_let(const std::string& name, const Expr& value);
  void add_range(const std::string& name, const Interval& range) { ranges_.push(name, range); }
  void add_loop(const For& loop);
  // Without lets and markers.
  Expr expand(const Expr& e) const { return without_likely(substitute(e, lets_)); }
  const Scope<Interval>& ranges() const { return ranges_; }

 private:
  Substitution lets_;
  Scope<Interval> ranges_;
};

// What the iterations of the steady state save by it.
//
// A condition that an inner serial loop does not change, or that stands outside of all inner loops,
// is computed once for a whole inner loop: nothing is saved. One over the lanes of a vector turns
// gathers into dense loads and selects into nothing: it pays unless the body is very large beside
// it. What is left, the min of a
// shifted tile or a clamp of scalars, saves an operation or two an iteration, and maybe that the
// start of a vector is known to be a multiple of something, for the divisions in the body.
struct Saving {
  bool always_pays = false;
  int over_lanes = 0;
  int operations = 0;
  bool divides = false;
};

// Where the steady state of one loop lies.
struct SteadyState {
  Interval range;                 // of the loop variable
  Expr needed;                    // and only if this holds; undefined: always
  bool has_thick_border = false;  // some iteration of the rest is a tile or more
  bool has_warm_up = false;       // the first iteration chooses otherwise, whatever runs inside
  int solved = 0;
  Saving saving;
};

// Rewrites the body of a loop for its steady state, and finds where that lies.
class SteadyRewriter : public Rewriter {
 public:
  SteadyRewriter(const For& loop, const PartitionContext& outer, bool inside_lanes);
  const SteadyState& steady() const { return steady_; }

 protected:
  Expr rewrite(const Expr& e) override;
  Stmt rewrite(const Stmt& s) override;

 private:
  // In the order of what wins.
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
      dependent_;  // the loop's variable, and those of inner loops that start from it
  std::unordered_set<std::string> inner_serial_, lanes_, of_unknown_extent_;
  std::unordered_set<std::string> decide_alone_;  // of these, what their own borders are
  std::vector<std::string> enclosing_;            // inner serial loops around the place of the walk
  std::unordered_map<std::string, int64_t> inner_extents_;  // constant ones
  std::unordered_map<std::string, Mark> marked_lets_;
  std::unordered_map<std::string, Expr> decided_lets_;
  std::unordered_map<const ExprNode*, Mark> marks_;  // of nodes of the body, which outlives this
};

}  // namespace retrograde::lower
