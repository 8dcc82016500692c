#include "lower/nests/output_order.h"

#include <algorithm>

namespace retrograde::lower {

namespace {

// The last of the first `count` Funcs that f reads; -1: none.
int last_read(const Program& program, const LoopedFunc& f, int count) {
  int last = -1;
  const auto note = [&](const std::string& name) {
    const auto found = program.index_of.find(name);
    if (found != program.index_of.end() && found->second < count)
      last = std::max(last, found->second);
  };
  for (const Definition& stage : f.stages) {
    walk(stage, [&](const Call& call) {
      if (call.call_type == CallType::Func) note(call.name);
    });
  }
  if (f.func->extern_definition) {
    for (const ExternArgument& arg : f.func->extern_definition->args) {
      if (arg.func) note(arg.func->name);
    }
  }
  return last;
}

void number(Program& program) {
  for (size_t i = 0; i < program.funcs.size(); ++i)
    program.index_of[program.funcs[i].name()] = static_cast<int>(i);
}

}  // namespace

void compute_outputs_early(Program& program) {
  for (int i = 0; i < static_cast<int>(program.funcs.size()); ++i) {
    if (!program.funcs[i].is_output) continue;
    const int place = last_read(program, program.funcs[i], i) + 1;
    const auto first = program.funcs.begin() + place, it = program.funcs.begin() + i;
    std::rotate(first, it, it + 1);
    number(program);
  }
}

}  // namespace retrograde::lower
