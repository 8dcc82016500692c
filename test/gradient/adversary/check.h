// The oracle for one random program: decides whether its gradient is right, wrong or refused.
#pragma once

#include "gradient/adversary/program.h"
#include "testing/judgement.h"

namespace retrograde::gradient {

using fuzz::Judged;
using fuzz::Judgement;

// The oracle runs these checks:
// - Differences: of sum w * output, over all outputs, along a random direction of all inputs, computed in double by the interpreter. They
//   are of sixth order in the step; the gap between one-sided and two-sided slopes bounds their accuracy.
// - Forward mode: <J v, w> against <v, J^T w>, along the inputs and along a Func.
// - Derivatives of derivatives: modes in several orders, and differences of the gradient.
// - Jacobians and Hessians: one product for each column.
// - A gradient that is requested alone: it is that of all gradients together.
// - Machine code, with `machine_code`: the gradients in their declared types, within the rounding that the interpreter
//   allows for, with and without a schedule, and the same bits on any number of threads.
//
// "Right" means that the gradient agrees with differences, and forward with reverse mode. The counts say which other
// checks ran. twin: null, or the same program with an extern stage, whose gradients run as machine code.
Judged judge(const AdversaryProgram& program, uint64_t seed, bool machine_code,
             const AdversaryProgram* twin = nullptr);
// The same, for the program that these choices generate.
Judged judge(Choices& choices, bool machine_code);
Judged judge_workload(Choices& choices, bool machine_code, fuzz::Workload kind);

}  // namespace retrograde::gradient
