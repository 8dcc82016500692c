#include "autoschedule/new_loop.h"

#include <algorithm>

#include "graph/names.h"

namespace retrograde::autoschedule {

std::string new_loop(const FuncContents& f, int stage, std::string wanted) {
  const std::vector<Dim>& loops = f.stage(stage).schedule.dims;
  const auto is_taken = [&] {
    return std::find(f.args.begin(), f.args.end(), wanted) != f.args.end() ||
           std::any_of(loops.begin(), loops.end(),
                       [&](const Dim& loop) { return loop.var == wanted; });
  };
  while (is_taken()) wanted += "_";
  return wanted;
}

std::string inner_loop(const FuncContents& f, int stage, const std::string& split) {
  const std::string name = without_numbers(split);
  return new_loop(f, stage, name.substr(name.rfind('.') + 1) + "i");
}

void vectorize(Stage stage, const VarOrRVar& loop, int lanes, TailStrategy tail) {
  const VarOrRVar inner(inner_loop(*stage.function(), stage.index(), loop.name()), loop.is_rvar);
  stage.split(loop, loop, inner, lanes, tail).vectorize(inner);
}

void run_serially(const FuncPtr& f) {
  for (int s = 0; s < f->stage_count(); ++s) {
    const std::vector<Dim> loops = f->stage(s).schedule.dims;
    for (const Dim& loop : loops) {
      if (loop.runs == ForType::Parallel)
        Stage(f, s).serial(VarOrRVar(loop.var, loop.is_reduction));
    }
  }
}

}  // namespace retrograde::autoschedule
