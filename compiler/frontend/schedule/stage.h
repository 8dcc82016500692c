// stage.h -- Stage, one definition of a Func to be scheduled; loop_directives.h has its directives.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "frontend/schedule/loop_directives.h"

namespace retrograde {

// One definition of a Func, to be scheduled: its pure definition or an update.
class Stage : public LoopDirectives<Stage> {
 public:
  // Stage `index` of a Func. `specialization` selects one of its schedules (StageLoops::specializations);
  // empty means the general one.
  Stage(graph::FuncPtr func, int index, std::vector<int> specialization = {})
      : place_{std::move(func), index, std::move(specialization)} {}

  // "blur" or "blur.update(0)".
  std::string name() const;
  const graph::FuncPtr& function() const { return place_.f; }  // the Func that it defines
  int index() const { return place_.stage; }  // 0: pure definition, i + 1: update i
  // The loops as text, innermost first.
  std::string dump_argument_list() const;
  // The loops as variables, innermost first.
  std::vector<VarOrRVar> split_vars() const;
  // Where the Func was declared: "blur.cpp:12".
  std::string source_location() const;

  // Splits an associative update into two reductions. The returned Func reduces over the variables that are not in
  // `preserved`, separately for each value of the preserved ones; this update then combines its results.
  // f.update().rfactor(r.y, u):
  //   f(x) = 0                           f_intm(x, u) = 0
  //   for r.y:                     =>    for u: for r.x: f_intm(x, u) += g(x, r.x, u)
  //     for r.x:                         f(x) = 0
  //       f(x) += g(x, r.x, r.y)         for r.y: f(x) += f_intm(x, r.y)
  // Preserved variables may come from splits. They are pure loops of the new Func, so they can be parallel or
  // vectorized. Each existing split, loop order and loop kind moves to the Func that has the loop. The stage must not
  // be specialized. The update must be provably f(x) = op(f(x), e) with an associative op that has an identity; op
  // must also be commutative unless the preserved variables are the outermost reduction loops. If op is min or max
  // with a payload (argmin), any of several equal extremes may win.
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
// Halide's older name for Stage.
using ScheduleHandle = Stage;

// Defined here because it needs the complete Stage.
template <class Self>
Stage LoopDirectives<Self>::specialize(const Expr& condition) {
  give(graph::Specialize{condition});
  graph::SchedulePlace special = place();
  special.special.push_back(graph::specialization_for(special.schedule(), condition));
  return Stage(special.f, special.stage, special.special);
}

}  // namespace retrograde
