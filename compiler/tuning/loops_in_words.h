// loops_in_words.h -- the loops around each definition of a scheduled pipeline, as a line of text for each.
//
//   definition: y in parallel (200), x (25), vectors of 8 along x
//   update 0:   inside "out" over y (200): x (200), r one after the other (3)
//
// The number in brackets is the number of iterations. A loop that a directive split has the name of the variable that
// the user wrote; loops with one iteration are left out.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "graph/function.h"
#include "tuning/program_sizes.h"

namespace retrograde::tuning {

struct DefinitionLoops {
  int stage = 0;     // 0: the first definition; n: update n - 1
  std::string text;  // without the name of the definition
  // About the loops of the definition and those around it.
  bool is_parallel = false, is_vectorized = false;
  bool is_interleaved = false;  // an unrolled loop runs over several elements
  double serial_trips =
      1;  // iterations of loops that run one after the other over reduction variables
};

// By the name of the Func. `nests` is the statement of phase Nests after add_argument_checks, which binds the sizes of
// buffers.
std::map<std::string, std::vector<DefinitionLoops>> loops_in_words(
    const Stmt& nests, const std::vector<FuncPtr>& scheduled, const ProgramSizes& sizes);

}  // namespace retrograde::tuning
