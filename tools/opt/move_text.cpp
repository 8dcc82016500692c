#include "move_text.h"

#include <algorithm>

#include "autoschedule/moves/move.h"
#include "diagnostics/error.h"
#include "graph/directives/wrappers.h"

namespace retrograde::opt {

namespace {

const std::string move_line = "\nmove ", on_device = " device";
constexpr planning::SizeDefaults defaults{planning::unknown_extent};

const planning::Move& move_of(const std::string& name) {
  if (const planning::Move* move = planning::find_move(name)) return *move;
  const std::string names =
      listed(planning::all_moves(), [](const planning::Move& m) { return quoted(m.name); });
  user_error(text("move ", quoted(name)), "a move must exist", text("the moves are ", names));
}

}  // namespace

MoveText split_move(const std::string& text) {
  const size_t at = text.find(move_line);
  if (at == std::string::npos) return {text, "", "", false};
  const size_t name = at + move_line.size(), end = std::min(text.find('\n', name), text.size());
  MoveText result{text.substr(0, at + 1), text.substr(name, end - name),
                  text.substr(std::min(end + 1, text.size())), false};
  if (result.func.ends_with(on_device)) {
    result.on_device = true;
    result.func.resize(result.func.size() - on_device.size());
  }
  return result;
}

std::string plans_after(const std::string& name, const MoveText& parts,
                        const std::vector<graph::FuncPtr>& outputs, int threads) {
  const planning::Move& move = move_of(name);
  const std::vector<graph::FuncPtr> wrapped = graph::apply_wrappers(outputs);
  const planning::Plan plan =
      parts.plan.empty() ? planning::import_plan(wrapped)
                         : planning::parse_plan(parts.plan, planning::make_program(wrapped));
  planning::validate(plan);
  const std::vector<graph::FuncPtr>& funcs = plan.program->funcs;
  const auto func =
      std::ranges::find(funcs, parts.func, [](const graph::FuncPtr& f) { return f->name; });
  if (func == funcs.end())
    user_error(text("move the Func ", quoted(parts.func)), "it must be one of the program");
  const planning::AccessGraph accesses(wrapped);
  const planning::SizeModel sizes(accesses, defaults);
  planning::Dependences dependences(accesses);
  planning::Machine machine = planning::reference_machine(Target("x86-64-linux-avx512"));
  machine.threads = threads;
  const auto id = static_cast<planning::FuncId>(func - funcs.begin());
  const planning::Device device;
  const planning::Context context{accesses, sizes, machine, dependences,
                                  parts.on_device ? &device : nullptr};
  std::string result;
  for (const planning::Plan& after : move.apply(plan, id, context)) {
    planning::validate(after);
    result += (result.empty() ? "" : "\n") + to_text(after);
  }
  return result.empty() ? "no plan\n" : result;
}

}  // namespace retrograde::opt
