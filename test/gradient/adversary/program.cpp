#include "gradient/adversary/program.h"

#include "gradient/adversary/maker.h"

namespace retrograde::gradient {

void Maker::run() {
  make_inputs();
  for (int n = c_.between(1, 4); n > 0; --n) add_func(c_.between(1, 2));
  if (c_.chance(10)) add_chain();
  if (c_.chance(8)) add_func(3);
  for (int n = c_.chance(45) ? c_.between(1, 2) : 0; n > 0; --n) add_structure();
  const bool has_loop = c_.chance(15);
  if (has_loop) add_loop();
  if (c_.chance(12)) add_custom();
  add_output();
  for (int d = 0; d < p_.output().dimensions(); ++d) {
    p_.region.mins.push_back(c_.chance(20) ? c_.around_zero(2) : 0);
    p_.region.extents.push_back(side_of_output());
  }
  p_.options.overwritten = overwriting();
  p_.only_inputs = c_.chance(40) || !p_.checks.along;
  if (c_.chance(has_loop ? 60 : 8)) {
    if (c_.chance(70)) {
      p_.options.checkpoint_states = c_.between(1, 4);
    } else {
      p_.options.checkpoint_bytes = c_.between(8, 600);
    }
  }
  choose_checks();
}

// Small ones, and odd ones that no vector fits.
int Maker::side_of_output() {
  if (c_.chance(10)) return c_.between(1, 3);
  return c_.chance(15) ? c_.between(7, 9) : natural_size;
}

Overwritten Maker::overwriting() {
  const int kind = c_.below(10);
  return kind == 9 ? Overwritten::Refuse : kind > 5 ? Overwritten::Store : Overwritten::Auto;
}

void Maker::choose_checks() {
  p_.checks.order = c_.chance(25) ? (c_.chance(25) ? 3 : 2) : 1;
  p_.checks.dense = c_.chance(8);
  p_.checks.schedule = c_.chance(60) ? c_.between(1, 1 << 16) : 0;
  p_.checks.primal = c_.chance(40);
  p_.checks.wild = c_.chance(20);
}

AdversaryProgram make_program(Choices& choices, bool as_extern) {
  AdversaryProgram program;
  Maker(choices, program, as_extern).run();
  return program;
}

}  // namespace retrograde::gradient
