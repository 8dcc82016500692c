// earlier_stages.h -- the stages before a loop over steps: which slice of time each of their iterations stores, and when
// the values that they store must be there.
#pragma once

#include <string>

#include "ir/interval.h"
#include "lower/loops/let_values.h"
#include "lower/loops/time_steps.h"

namespace retrograde::lower {

bool reads_storage(const Expr& e);

// Whether a nest of plain loops stores only to the Func and to Funcs that are stored inside of it, and has no other
// effect.
bool stores_only_to(const std::string& func, const Stmt& nest);

class EarlierStages {
 public:
  EarlierStages(const std::string& func, TimeSteps& steps, const LetValues& value)
      : func_(func), steps_(steps), value_(value) {}

  // Adds a stage to the steps; false if its iterations cannot run for one slice at a time.
  bool add(const Stmt& nest);

  // `step`: the loop over the steps, none of which reads the slice that it stores. `iterations`: its range.
  SliceStart slice_start(const Stmt& step, const Interval& iterations) const;

 private:
  const std::string& func_;
  TimeSteps& steps_;
  const LetValues& value_;

  static bool find_time_loop(const Expr& time, EarlierStage& stage);
  bool reads_only_at(const Expr& time, const Stmt& nest) const;
  std::vector<Expr> parts_of(const Stmt& nest, const For* except, bool with_values) const;
  bool steps_store_alike(const Stmt& step) const;
};

}  // namespace retrograde::lower
