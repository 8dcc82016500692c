#include "lower/nests/output_order.h"

#include <algorithm>

#include "lower/nests/fusing_checks.h"

namespace retrograde::lower {

void compute_outputs_early(Program& program) {
  for (int i = 0; i < static_cast<int>(program.funcs.size()); ++i) {
    if (!program.funcs[i].is_output) continue;
    int place = 0;  // behind all that it reads
    for (const int callee : callees_of(program, i)) place = std::max(place, callee + 1);
    const auto output = program.funcs.begin() + i;
    std::rotate(program.funcs.begin() + place, output, output + 1);
    program.number();
  }
}

}  // namespace retrograde::lower
