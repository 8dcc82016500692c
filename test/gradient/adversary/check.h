// The oracle of one program: its gradient is right, or it is refused.
#pragma once

#include "gradient/adversary/program.h"
#include "testing/judgement.h"

namespace retrograde::gradient {

using fuzz::Judged;
using fuzz::Judgement;

// Differences: of sum w * output along a random direction of all inputs, in double by the
// interpreter, of sixth order in the step, with the differences between one-sided and two-sided
// slopes as the bound on what they can tell. Forward mode: <J v, w> against <v, J^T w>, along the
// inputs and along a Func. Derivatives of derivatives: modes in several orders, and differences of
// the gradient. Jacobians and Hessians: one product for each column. Machine code, when asked for:
// the gradients in their declared types, within the rounding that the interpreter allows for, with
// and without a schedule, and the same bits on any number of threads.
// Right: against differences, and forward against reverse. Counts: what was done beside that.
// twin: null, or the same program with an extern stage, whose gradients run as machine code.
Judged judge(const AdversaryProgram& program, uint64_t seed, bool machine_code,
             const AdversaryProgram* twin = nullptr);
// The same from choices.
Judged judge(Choices& choices, bool machine_code);

}  // namespace retrograde::gradient
