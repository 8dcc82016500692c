#include "gradient/adversary/program.h"

#include "gradient/adversary/extern_stage.h"

namespace retrograde::gradient {

AdversaryProgram make_adversary(Choices& choices, bool as_extern) {
  fuzz::Style style = fuzz::Style::gradients();
  if (as_extern) style.extern_sine = define_sine;
  return make_adversary(choices, style);
}

AdversaryProgram make_adversary(Choices& choices, const fuzz::Style& style) {
  AdversaryProgram p{fuzz::make_program(choices, style), {}, false, {}};
  const int overwritten = choices.below(10);
  p.options.overwritten = overwritten == 9  ? Overwritten::Refuse
                          : overwritten > 5 ? Overwritten::Store
                                            : Overwritten::Auto;
  p.only_inputs = choices.chance(40) || p.has_rule;
  if (choices.chance(p.has_loop ? 60 : 8)) {
    if (choices.chance(70)) {
      p.options.checkpoint_states = choices.between(1, 4);
    } else {
      p.options.checkpoint_bytes = choices.between(8, 600);
    }
  }
  p.checks.order = choices.chance(25) ? (choices.chance(25) ? 3 : 2) : 1;
  p.checks.dense = choices.chance(8);
  p.checks.schedule = choices.chance(60) ? choices.between(1, 1 << 16) : 0;
  p.checks.primal = choices.chance(40);
  p.checks.wild = choices.chance(20);
  p.checks.several = choices.chance(30);
  return p;
}

// Overwritten values are kept, as users get them by default: a workload should not be refused.
AdversaryProgram make_workload_adversary(Choices& choices, fuzz::Workload kind) {
  AdversaryProgram p{fuzz::make_workload(choices, kind), {}, false, {}};
  p.options.overwritten = choices.chance(30) ? Overwritten::Store : Overwritten::Auto;
  p.only_inputs = !choices.chance(30);
  if (choices.chance(p.has_loop ? 15 : 0)) p.options.checkpoint_states = choices.between(1, 4);
  p.checks.order = choices.chance(12) ? 2 : 1;
  p.checks.dense = choices.chance(4);
  p.checks.schedule = choices.chance(40) ? choices.between(1, 1 << 16) : 0;
  p.checks.primal = choices.chance(40);
  p.checks.wild = choices.chance(15);
  p.checks.several = choices.chance(20);
  p.checks.one_input = choices.chance(30);
  return p;
}

std::string to_text(const AdversaryProgram& program) {
  const char* const overwritten = program.options.overwritten == Overwritten::Store ? "values kept"
                                  : program.options.overwritten == Overwritten::Refuse
                                      ? "overwriting refused"
                                      : "values kept within the budget";
  return fuzz::to_text(program) + overwritten +
         (program.only_inputs ? ", gradients of inputs only\n" : "\n");
}

}  // namespace retrograde::gradient
