// stage.h -- one definition of a Func, to be scheduled: see loop_directives.h.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "frontend/schedule/loop_directives.h"

namespace retrograde {

class Stage : public LoopDirectives<Stage> {
 public:
  // `specialization`: which of the stage's schedules; see StageLoops::specializations. Empty:
  // the general one.
  Stage(graph::FuncPtr func, int index, std::vector<int> specialization = {})
      : place_{std::move(func), index, std::move(specialization)} {}

  // "blur", "blur.update(0)"
  std::string name() const;
  const graph::FuncPtr& function() const { return place_.f; }
  int index() const { return place_.stage; }
  std::string dump_argument_list() const;     // the loops, innermost first
  std::vector<VarOrRVar> split_vars() const;  // the same as variables
  std::string source_location() const;        // where the Func was declared: "blur.cpp:12"

  // Cuts an associative update in two: a new Func, which is returned, reduces over the variables
  // that are not named here, separately for each value of those that are; what is left of the
  // update combines its results.  f.update().rfactor(r.y, u):
  //   f(x) = 0                           f_intm(x, u) = 0
  //   for r.y:                     =>    for u: for r.x: f_intm(x, u) += g(x, r.x, u)
  //     for r.x:                         f(x) = 0
  //       f(x) += g(x, r.x, r.y)         for r.y: f(x) += f_intm(x, r.y)
  // The variables may come from splits, and are pure loops of the new Func: parallel or vectorized
  // at will. Splits, order and kinds of loops go to whichever of the two has the loop; a
  // specialized stage can't be cut. The update must be proven to be
  // f(x) = op(f(x), e) with an associative op that has an identity; and commutative, unless
  // the variables are the outermost reduction loops. Where op is min or max with payload (argmin),
  // any of several equal extremes may win.
  // Requires: only an update that reduces is factored; only reduction loops are factored; each loop
  // is named once; the new variables differ from each other and from the Func's; only an
  // associative update has partial results that can be combined; partial results over inner loops
  // change the order of the reduction; a specialized stage keeps its definition; a stage in the
  // loops of another one keeps its own; reduction variables are fused only with each other.
  Func rfactor(const std::vector<std::pair<RVar, Var>>& preserved);
  Func rfactor(const RVar& r, const Var& v);

 private:
  friend class LoopDirectives<Stage>;
  const graph::SchedulePlace& loops() const { return place_; }

  graph::SchedulePlace place_;
};
using ScheduleHandle = Stage;

template <class Self>
Stage LoopDirectives<Self>::specialize(const Expr& condition) {
  give(graph::Specialize{condition});
  graph::SchedulePlace special = place();
  special.special.push_back(graph::specialization_for(special.schedule(), condition));
  return Stage(special.f, special.stage, special.special);
}

}  // namespace retrograde
