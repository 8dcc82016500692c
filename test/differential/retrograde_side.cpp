// The pipelines in Retrograde.
#include <retrograde/retrograde.h>

#include <limits>

#include "differential/side.h"
#include "testing/interpreter.h"

namespace differential {
namespace in_retrograde {
using namespace retrograde;
static Target jit_target() { return get_jit_target_from_environment(); }

#include "differential/pipelines/all.h"
}  // namespace in_retrograde

std::vector<HostBuffer> run_in_retrograde(const std::string& name, bool scheduled) {
  return in_retrograde::realize_built(in_retrograde::find_case(name).build(scheduled));
}

std::vector<retrograde::oracle::Array> interpret(const std::string& name) {
  using namespace retrograde;
  const in_retrograde::Built built = in_retrograde::find_case(name).build(false);
  std::vector<graph::FuncPtr> funcs;
  std::vector<oracle::Region> regions;
  for (size_t i = 0; i < built.outputs.size(); ++i) {
    funcs.push_back(built.outputs[i].function());
    regions.push_back({in_retrograde::mins_of(built, i), built.extents[i]});
  }
  oracle::Interpreter interpreter(
      oracle::InterpreterOptions{.widen = false, .rounding = oracle::Rounding::Reordering});
  return interpreter.realize(funcs, regions);
}

void print_nest_in_retrograde(const std::string& name) {
  in_retrograde::find_nest(name).print_loop_nest();
}

}  // namespace differential
