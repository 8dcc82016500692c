// A sane schedule for Funcs that differentiation made and that nobody scheduled.
//
// Inlining an adjoint into every reader multiplies work: a chain of n stencils with k taps costs
// k^n. So, in a pipeline that contains adjoints, an untouched Func is computed at root when it
// reduces, scatters, or is read more than once and costs more than a few operations; its innermost
// dimension is vectorized, its outermost run in parallel. That goes for primal Funcs too, which
// both directions read. A directive of the user on a Func or one of its stages switches this off
// for that Func. Pipelines without adjoints are left as they are.
#pragma once

#include <unordered_map>
#include <vector>

#include "frontend/function.h"

namespace retrograde::ir {

// What multiplies an adjoint must beware of.
struct AdjointTraits {
  // Exactly 0 where a consumer chose another branch or reads nothing: a factor may be infinite or
  // NaN there.
  bool masked = false;
  // Infinite where it passed the pole of a partial: a factor may be 0 there, as in a norm at 0.
  bool singular = false;
  void add(const AdjointTraits& other) {
    masked |= other.masked;
    singular |= other.singular;
  }
};

// A Func made by differentiation.
struct AdjointContents : FuncContents {
  AdjointTraits traits;
  FuncPtr copy() const override { return std::make_shared<AdjointContents>(*this); }
};

struct ChosenSchedule {
  FuncSchedule func;
  std::vector<StageSchedule> stages;
};
// Chosen schedules by Func; a Func that is not here keeps its own. The Funcs are not changed.
using DefaultSchedules = std::unordered_map<const FuncContents*, ChosenSchedule>;
DefaultSchedules default_schedules(const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::ir
