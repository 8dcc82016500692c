#include "lower/program.h"

#include <algorithm>

#include "graph/graph.h"
#include "lower/nests/copy_statement.h"

namespace retrograde::lower {

namespace {

bool is_given(const LoopLevel& level) { return level.kind != LoopLevel::Kind::Inlined; }
bool is_same_loop(const LoopLevel& a, const LoopLevel& b) {
  return a.kind == b.kind && a.func == b.func && a.var == b.var;
}

// How a stage uses a variable: as a loop over pure variables, or over reduction variables.
struct LoopKinds {
  bool is_pure = false, is_reduction = false;
};
void find_kinds(const StageLoops& schedule, const std::string& var, LoopKinds& kinds) {
  for (const Dim& dim : schedule.dims) {
    if (dim.var == var) (dim.is_reduction ? kinds.is_reduction : kinds.is_pure) = true;
  }
  for (const StageLoops& other : schedule.specializations) find_kinds(other, var, kinds);
}

}  // namespace

std::string value_buffer_name(const FuncContents& f, int index) {
  return f.types.size() == 1 ? f.name : f.name + "." + std::to_string(index);
}

std::string original_name(const std::string& name) {
  size_t mark = name.rfind(".$");
  bool is_copy = mark != std::string::npos && mark + 2 < name.size() &&
                 name.find_first_not_of("0123456789", mark + 2) == std::string::npos;
  return is_copy ? name.substr(0, mark) : name;
}

std::string to_text(const Program& program) {
  std::vector<FuncPtr> funcs, outputs;
  for (const LoopedFunc& f : program.funcs) {
    const auto copy = std::make_shared<FuncContents>(*f.func);
    copy->schedule = f.schedule;
    for (int i = 0; i < copy->stage_count(); i++) copy->stage(i) = f.stages[i];
    funcs.push_back(copy);
    if (f.is_output) outputs.push_back(copy);
  }
  return graph::to_text({outputs, funcs, graph::parameters_of(outputs)});
}

bool is_stored_where_computed(const LoopedFunc& f) {
  const LoopLevel& store = f.schedule.store_level;
  return !is_given(store) || is_same_loop(store, f.schedule.compute_level);
}

bool is_hoisted(const LoopedFunc& f) {
  const FuncPlacement& at = f.schedule;
  return !f.is_output && is_given(at.hoist_level) &&
         !is_same_loop(at.hoist_level,
                       is_given(at.store_level) ? at.store_level : at.compute_level);
}

constexpr const char* place_suffix = ".place";
std::string place_name(const std::string& func) { return func + place_suffix; }
bool is_place_name(const std::string& name) { return name.ends_with(place_suffix); }

std::string stage_prefix(const std::string& func, int stage) {
  return func + ".s" + std::to_string(stage) + ".";
}

bool is_pure_loop(const Program& program, const std::string& loop) {
  const LoopName name = decode_loop_name(loop);
  const LoopedFunc* func = program.find(name.func);
  if (!func) return false;
  const auto stage = static_cast<size_t>(std::stoi(name.stage));
  LoopKinds kinds;
  if (stage < func->stages.size()) find_kinds(func->stages[stage].schedule, name.var, kinds);
  return kinds.is_pure && !kinds.is_reduction;
}

}  // namespace retrograde::lower
