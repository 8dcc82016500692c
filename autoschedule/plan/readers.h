// readers.h -- the stages that read a Func, and whether they run inside of a loop.
#pragma once

#include <optional>
#include <vector>

#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

// The stages that read each Func of a program in this order, those of the Func itself excepted.
std::vector<std::vector<StageId>> readers_of(const std::vector<graph::FuncPtr>& funcs);
// The stage that owns a loop, which others may share.
StageId owner_of(const Plan& plan, const LoopRef& loop);
// The depth of the level's loop in a stage, which may share it; nullopt if it is no loop of the stage. Loops alike of
// different stages may be at different depths.
std::optional<int> depth_in(const Plan& plan, StageId stage, const Level& level);

class Readers {
 public:
  // The plan is not copied. Requires (InternalError): its loops exist.
  explicit Readers(const Plan& plan) : plan_(plan) {}
  // A stage that reads the Func, also through inlined Funcs, and runs outside of the level's loop.
  std::optional<StageId> find_outside(FuncId func, const Level& level) const;

 private:
  const Plan& plan_;

  const graph::FuncContents& func(FuncId id) const {
    return *plan_.program->funcs[static_cast<size_t>(id)];
  }
  bool is_inside(StageId stage, const Level& level) const;
  bool is_place_inside(const LoopRef& loop, const Level& level) const;
};

}  // namespace retrograde::planning
