// plan_round_trip.h -- whether a schedule survives as a plan: the text of its plan, and the directives emitted from it,
// give the plan back, and both schedules give the same loops.
#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "autoschedule/plan/plan.h"
#include "diagnostics/error.h"
#include "graph/copy_graph.h"
#include "graph/directives/directive.h"
#include "graph/directives/wrappers.h"
#include "ir/print.h"
#include "lower/lower.h"
#include "support/same_numbers.h"

namespace retrograde {

// A copy of the graph in which loops have the names that they have in another, whose Funcs and loops are alike.
inline std::vector<graph::FuncPtr> with_loop_names_of(const std::vector<graph::FuncPtr>& outputs,
                                                      const std::vector<graph::FuncPtr>& other) {
  const std::vector<graph::FuncPtr> copy = graph::copy_graph(outputs).outputs;
  const auto funcs = graph::topological_order(copy), models = graph::topological_order(other);
  std::map<std::pair<std::string, std::string>, std::string> renamed;  // Func and loop
  for (size_t f = 0; f < funcs.size(); ++f) {
    for (int s = 0; s < funcs[f]->stage_count(); ++s) {
      graph::StageLoops& own = funcs[f]->stage(s).schedule;
      const graph::LoopList& wanted = models[f]->stage(s).schedule.dims;
      const graph::LoopList before = own.dims;
      if (before.size() != wanted.size()) continue;
      const auto rename = [&](const std::string& from, const std::string& to) {
        if (from != to) graph::apply_directive(graph::RenameLoop{from, to}, own);
      };
      const auto is_same = [](const graph::Dim& a, const graph::Dim& b) { return a.var == b.var; };
      if (std::ranges::equal(before, wanted, is_same)) continue;
      for (const graph::Dim& dim : before) rename(dim.var, dim.var + "$now");
      for (size_t i = 0; i < before.size(); ++i) {
        rename(before[i].var + "$now", wanted[i].var);
        renamed[{funcs[f]->name, before[i].var}] = wanted[i].var;
        if (auto align = own.fuse_alignment.extract(before[i].var))
          own.fuse_alignment[wanted[i].var + "$now"] = align.mapped();
      }
      std::map<std::string, LoopAlignStrategy> aligned;
      for (const auto& [loop, how] : own.fuse_alignment)
        aligned[loop.substr(0, loop.rfind("$now"))] = how;
      own.fuse_alignment = aligned;
    }
  }
  for (const graph::FuncPtr& f : funcs) {
    const auto rename = [&](graph::LoopLevel& level) {
      const auto found = renamed.find({level.func, level.var});
      if (found != renamed.end()) level.var = found->second;
    };
    rename(f->schedule.compute_level);
    rename(f->schedule.store_level);
    rename(f->schedule.hoist_level);
    for (int s = 0; s < f->stage_count(); ++s) rename(f->stage(s).schedule.fuse_level);
  }
  return copy;
}

// The text with the conditions of each guard in alphabetical order: theirs is the order of the splits, which plans do not
// keep.
inline std::string with_ordered_guards(const std::string& statement) {
  std::istringstream lines(statement);
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    const size_t begin = line.find("if ("), end = line.rfind(") {");
    if (begin != std::string::npos && end != std::string::npos) {
      std::set<std::string> parts;
      std::string rest = line.substr(begin + 4, end - begin - 4);
      for (size_t at; (at = rest.find(" && ")) != std::string::npos; rest.erase(0, at + 4))
        parts.insert(rest.substr(0, at));
      parts.insert(rest);
      line = line.substr(0, begin + 4) + listed(parts) + line.substr(end);
    }
    result += line + "\n";
  }
  return result;
}

inline std::string lowered_text(const std::vector<graph::FuncPtr>& outputs, const Target& target,
                                const std::string& stop_after) {
  const lower::LowerOptions options{target, false, {}, stop_after};
  return with_ordered_guards(
      text(lower::lower("plan", outputs, lower::infer_arguments(outputs), options).body));
}

struct PlanRoundTrip {
  int funcs = 0;
  std::map<planning::Opacity, int> opaque;
  std::string failure;  // empty: none
  std::string broken;   // the invariant that the schedule breaks, as users' schedules may
};

// Lowers up to this pass, or not at all when it is empty.
inline PlanRoundTrip plan_round_trip(const std::vector<graph::FuncPtr>& scheduled,
                                     const Target& target = get_host_target(),
                                     const std::string& stop_after = "build_loop_nests") {
  const std::vector<graph::FuncPtr> outputs = graph::apply_wrappers(scheduled);
  const planning::Plan plan = planning::import_plan(outputs);
  PlanRoundTrip result;
  for (const auto& func : plan.funcs) {
    ++result.funcs;
    if (func->opacity != planning::Opacity::None) ++result.opaque[func->opacity];
  }
  const std::string written = to_text(plan);
  const planning::Plan read = planning::parse_plan(written, plan.program);
  const std::vector<graph::FuncPtr> emitted = planning::emit_plan(plan);
  const planning::Plan again = planning::import_plan(emitted);
  result.broken = broken_invariant(plan);
  if (!(read == plan) || hash_of(read) != hash_of(plan)) {
    result.failure = "the text gives another plan:\n" + written + "and\n" + to_text(read);
  } else if (to_text(again) != written) {
    result.failure = "the directives give another plan:\n" + written + "and\n" + to_text(again);
  }
  for (size_t f = 0; f < plan.funcs.size() && result.failure.empty(); ++f) {
    if (!(*plan.funcs[f] == *again.funcs[f]))
      result.failure = "equal texts, other plans:\n" + written;
  }
  if (!result.failure.empty() || stop_after.empty()) return result;
  const std::string before =
      same_numbers(lowered_text(with_loop_names_of(outputs, emitted), target, stop_after));
  const std::string after = same_numbers(lowered_text(emitted, target, stop_after));
  if (before != after) {
    const auto at = std::ranges::mismatch(before, after).in1 - before.begin();
    const auto begin = static_cast<size_t>(std::max<std::ptrdiff_t>(at - 300, 0));
    result.failure = "the loops differ:\n" + before.substr(begin, 900) + "\nand\n" +
                     after.substr(begin, 900) + "\nfor\n" + written;
  }
  return result;
}

}  // namespace retrograde
