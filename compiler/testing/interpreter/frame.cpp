#include "testing/interpreter/frame.h"

#include "ir/lets.h"

namespace retrograde::oracle {

Frame frame_of(const graph::FuncContents& func, int stage) {
  Frame frame;
  frame.definition = map_exprs(func.stage(stage), ir::without_lets);
  for (const std::string& arg : func.args) frame.places.emplace(arg, frame.places.size());
  for (const auto& rvar : frame.definition.rvars)
    frame.places.emplace(rvar.var, frame.places.size());
  for (size_t d = 0; d < func.args.size(); ++d) {
    const auto* variable = frame.definition.args[d].as<ir::Variable>();
    frame.is_pure_arg.push_back(variable && variable->name == func.args[d]);
  }
  frame.point.resize(frame.places.size());
  return frame;
}

}  // namespace retrograde::oracle
