// The groups of a plan: stages whose loops are nested.
#include <algorithm>
#include <utility>

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

namespace {

bool insert_once(std::vector<FuncId>& list, FuncId func) {
  const auto place = std::ranges::lower_bound(list, func);
  const bool is_new = place == list.end() || *place != func;
  if (is_new) list.insert(place, func);
  return is_new;
}

// Whether the Func is inlined and has one value, which composed reads can replace.
bool is_value(const Plan& plan, const FuncNode& node, FuncId func) {
  return is_inlined(plan, func) && plan.of(func).opacity == Opacity::None &&
         node.stages.size() == 1;
}

// The Func in whose loops it runs; itself if there is none.
FuncId host_of(const Plan& plan, FuncId func) {
  const Level& compute = plan.of(func).placement.compute;
  if (compute.kind == Level::Kind::At) return compute.loop.stage.func;
  for (const Nest& nest : plan.of(func).nests)
    if (nest.shared_with && nest.shared_with->stage.func != func)
      return nest.shared_with->stage.func;
  return func;
}

}  // namespace

ProgramGroups::ProgramGroups(const AccessGraph& graph)
    : graph_(graph), groups_(graph.funcs().size()), number_(graph.funcs().size(), none) {}

// A changed Func may change the groups of what reads it, and those of the Funcs in whose loops it runs and ran.
std::vector<FuncId> ProgramGroups::update(const Plan& plan, const std::vector<FuncId>& changed) {
  std::vector<FuncId> numbers, funcs;  // of groups that are found anew
  const auto take_apart = [&](FuncId number) {
    PlannedGroup group = std::exchange(groups_[static_cast<size_t>(number)], {});
    if (!group.funcs.empty()) insert_once(numbers, number);
    for (const FuncId func : group.funcs) insert_once(funcs, func);
  };
  std::vector<FuncId> reached = changed;
  std::vector<bool> is_reached(groups_.size());
  for (const FuncId func : changed) is_reached[static_cast<size_t>(func)] = true;
  for (size_t i = 0; i < reached.size(); ++i) {
    const FuncId number = number_of(reached[i]);
    if (number != none) take_apart(number);
    if (number != none && i >= changed.size()) continue;
    for (const StageId reader : graph_.consumers(reached[i])) {
      if (!is_reached[static_cast<size_t>(reader.func)]) reached.push_back(reader.func);
      is_reached[static_cast<size_t>(reader.func)] = true;
    }
  }
  for (const FuncId func : changed) {
    number_of(func) = is_value(plan, graph_.func(func), func) ? none : func;
    insert_once(funcs, func);
  }
  for (const FuncId func : changed) {
    const FuncId host = number_of(func) != none ? number_of(host_of(plan, func)) : none;
    if (host != none) take_apart(host);
  }
  std::erase_if(funcs, [&](FuncId func) { return number_of(func) == none; });
  join(plan, funcs);
  for (const FuncId func : funcs) {
    groups_[static_cast<size_t>(number_of(func))].funcs.push_back(func);
    insert_once(numbers, number_of(func));
  }
  for (const FuncId number : numbers) {
    PlannedGroup& group = groups_[static_cast<size_t>(number)];
    for (const FuncId func : group.funcs) {
      for (const StageNode& stage : graph_.func(func).stages) {
        group.inlined.emplace_back();
        add_reads(stage, group);
      }
    }
  }
  return numbers;
}

// Finds the numbers of the groups of these Funcs, which run in loops of each other alone.
void ProgramGroups::join(const Plan& plan, const std::vector<FuncId>& funcs) {
  const auto last = [&](FuncId func) {
    while (number_of(func) != func) func = number_of(func);
    return func;
  };
  for (const FuncId func : funcs) number_of(func) = func;
  for (const FuncId func : funcs) {
    const FuncId host = host_of(plan, func);
    if (number_of(host) == none) continue;
    const FuncId a = last(func), b = last(host);
    number_of(std::min(a, b)) = std::max(a, b);
  }
  for (const FuncId func : funcs) number_of(func) = last(func);
}

// Adds the Funcs of other groups that a stage reads, and those that are inlined into it.
void ProgramGroups::add_reads(const StageNode& stage, PlannedGroup& group) const {
  for (const Access& access : stage.reads) {
    const FuncId read = access.of;
    if (read < 0 || read == stage.id.func) continue;
    if (number_[static_cast<size_t>(read)] != none) {
      if (!std::ranges::binary_search(group.funcs, read)) insert_once(group.reads, read);
    } else if (insert_once(group.inlined.back(), read)) {
      add_reads(graph_.func(read).stages[0], group);
    }
  }
}

}  // namespace retrograde::planning
