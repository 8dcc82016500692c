// apply_log.cpp -- applies a schedule log to a program. The numbers that make names unique in a
// process differ between the two, so names are matched first.
#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <set>

#include "diagnostics/error.h"
#include "graph/copy_graph.h"
#include "graph/definitions/rfactor.h"
#include "graph/directives/directive_fields.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"
#include "graph/graph.h"
#include "graph/names.h"
#include "graph/text/binder.h"
#include "ir/visit.h"

namespace retrograde::graph {

namespace {

// The element with this name, or the only one whose name differs just by numbers; null when there
// is none.
template <typename Range, typename NameOf>
auto find_by_name(const Range& all, const std::string& name, const NameOf& name_of)
    -> decltype(&*all.begin()) {
  decltype(&*all.begin()) found = nullptr;
  int count = 0;
  for (const auto& one : all) {
    if (name_of(one) == name) return &one;
    if (without_numbers(name_of(one)) != without_numbers(name)) continue;
    found = &one;
    ++count;
  }
  return count == 1 ? found : nullptr;
}

// The numbers that make the name unique, in order.
std::vector<uint64_t> numbers_of(const std::string& name) {
  std::vector<uint64_t> numbers;
  for (size_t at = name.find('$'); at != std::string::npos; at = name.find('$', at + 1))
    numbers.push_back(std::strtoull(name.c_str() + at + 1, nullptr, 10));
  return numbers;
}

// Groups names by their text without numbers; within a group, orders them by their numbers.
class NameGroups {
 public:
  void add(const std::string& name) {
    groups_[without_numbers(name)].emplace(numbers_of(name), name);
  }
  // The name in `others` at the same position in its group; null unless the groups have equal
  // sizes.
  const std::string* counterpart_of(const std::string& name, const NameGroups& others) const {
    const std::string plain = without_numbers(name);
    const auto mine = groups_.find(plain), theirs = others.groups_.find(plain);
    if (mine == groups_.end() || theirs == others.groups_.end() ||
        mine->second.size() != theirs->second.size())
      return nullptr;
    const auto place = mine->second.find(numbers_of(name));
    if (place == mine->second.end()) return nullptr;
    return &std::next(theirs->second.begin(), std::distance(mine->second.begin(), place))->second;
  }

 private:
  std::map<std::string, std::map<std::vector<uint64_t>, std::string>> groups_;
};

void add_loops(const StageLoops& schedule, std::vector<std::string>& loops) {
  const auto add = [&](const std::string& loop) {
    if (std::ranges::find(loops, loop) == loops.end()) loops.push_back(loop);
  };
  for (const Dim& dim : schedule.dims) add(dim.var);
  for (const StageLoops& special : schedule.specializations) add_loops(special, loops);
}

class Replay {
 public:
  Replay(const ScheduleLog& log, const std::vector<FuncPtr>& outputs) {
    const Graph graph = graph_of(outputs);
    for (const FuncPtr& f : graph.funcs) {
      names_.funcs.emplace(f->name, f);
      in_program_.add(f->name);
      for (const auto& output : f->outputs) names_.outputs.emplace(output->name, output);
    }
    for (const auto& parameter : graph.parameters)
      names_.parameters.emplace(parameter->name, parameter);
    std::set<std::string> created;
    for (const ScheduleLog::Entry& entry : log.entries) {
      if (!created.count(entry.func)) in_log_.add(entry.func);
      created.insert(made_by(entry.directive));
    }
  }

  void give(const ScheduleLog::Entry& entry) {
    const SchedulePlace place{func(entry.func), entry.stage, entry.special};
    check(place, entry);
    Directive directive = entry.directive;
    keep_names(place, directive);
    visit_names(directive, Overloaded{[&](NamedFunc& name) { name = func_or_image(name); },
                                      [&](NamedLoop& name) { name = loop(place, name); },
                                      [&](LoopLevel& level) { find(level); },
                                      [&](Expr& e) { note_parameters(e); }});
    Binder(names_, nullptr, nullptr)(directive);
    if (const auto* wrap = std::get_if<Wrap>(&directive)) {
      make(wrap->made, wrapper_of(place.f, funcs(wrap->users), without_numbers(wrap->made), false));
    } else if (const auto* clone = std::get_if<Clone>(&directive)) {
      make(clone->made,
           wrapper_of(place.f, funcs(clone->users), without_numbers(clone->made), true));
    } else if (const auto* copy = std::get_if<CopyInput>(&directive)) {
      make(copy->made,
           copied_input(place.f, image_of_program(copy->image), without_numbers(copy->made)));
    } else if (const auto* factor = std::get_if<FactorOut>(&directive)) {
      make(factor->made, factor_out(place, factor->preserved, without_numbers(factor->made)));
    } else {
      give_directive(place, std::move(directive));
    }
  }

 private:
  static constexpr const char* asked = "apply a schedule log";

  // 1. A stage directive applies to a stage, a Func directive to a Func. 2. That stage exists.
  static void check(const SchedulePlace& place, const ScheduleLog::Entry& entry) {
    const bool fits = is_of_stage(entry.directive)
                          ? entry.stage >= 0 && entry.stage < place.f->stage_count()
                          : entry.stage < 0;
    const StageLoops* now =
        fits && entry.stage >= 0 ? &place.f->stage(entry.stage).schedule : nullptr;
    for (const int step : entry.special) {
      const bool is_there =
          now && step >= 0 && step < static_cast<int>(now->specializations.size());
      now = is_there ? &now->specializations[static_cast<size_t>(step)] : nullptr;
    }
    if (fits && (entry.special.empty() || now)) return;
    user_error(asked, "the target of a directive exists",
               text(quoted(ScheduleLog{{entry}}.to_text()), " has no target"),
               "Apply it to the program that it was taken from");
  }

  void make(const std::string& name, const FuncPtr& f) {
    created_[name] = names_.funcs[name] = names_.funcs[f->name] = f;
  }

  // If a new loop reuses the name of the loop that it derives from, it does so here too.
  static void keep_names(const SchedulePlace& place, Directive& directive) {
    const auto keep = [&](std::string& created, const std::string& old) {
      if (created == old) created = loop(place, old);
    };
    if (auto* split = std::get_if<SplitLoop>(&directive)) {
      keep(split->outer, split->old);
      keep(split->inner, split->old);
    } else if (auto* fuse = std::get_if<FuseLoops>(&directive)) {
      const std::string fused = fuse->fused;
      for (const std::string& old : {fuse->inner, fuse->outer}) {
        if (fused == old) fuse->fused = loop(place, old);
      }
    }
  }

  FuncPtr func_or_none(const std::string& name) {
    if (const auto* created = find_or_null(created_, name)) return *created;
    if (const std::string* same = in_log_.counterpart_of(name, in_program_))
      return names_.funcs.at(*same);
    if (const auto* found = find_by_name(names_.funcs, name, [](const auto& f) { return f.first; }))
      return found->second;
    // The Func that reads an image, created at its first mention.
    for (const auto& [image, contents] : names_.parameters) {
      if (contents->is_buffer && image + "_im" == without_numbers(name))
        return names_.funcs[name] = func_of_image(contents);
    }
    return nullptr;
  }
  FuncPtr func(const std::string& name) {
    if (const FuncPtr found = func_or_none(name)) return found;
    user_error(
        asked, "every Func that it names is one of the program",
        text("none is called ", quoted(name)),
        "Apply it to the program that it was taken from, or remove the directives of that Func");
  }
  ParameterPtr image(const std::string& name) const {
    const auto* found =
        find_by_name(names_.parameters, name, [](const auto& p) { return p.first; });
    return found && found->second->is_buffer ? found->second : nullptr;
  }
  ParameterPtr image_of_program(const std::string& name) const {
    if (const ParameterPtr found = image(name)) return found;
    user_error(
        asked, "every image that it names is one of the program",
        text("none is called ", quoted(name)),
        "Apply it to the program that it was taken from, or remove the directives of that image");
  }
  // The source of a prefetch need not belong to the program.
  NamedFunc func_or_image(const std::string& name) {
    if (const ParameterPtr found = image(name)) return found->name;
    const FuncPtr found = func_or_none(name);
    return found ? found->name : name;
  }
  std::vector<FuncPtr> funcs(const std::vector<NamedFunc>& names) {
    return mapped(names, [&](const std::string& name) { return func(name); });
  }
  static std::string loop_of(const std::vector<std::string>& loops, const std::string& name) {
    const std::string* found =
        find_by_name(loops, name, [](const std::string& loop) { return loop; });
    return found ? *found : name;
  }
  static NamedLoop loop(const SchedulePlace& place, const std::string& name) {
    return loop_of(mapped(place.schedule().dims, &Dim::var), name);
  }
  void find(LoopLevel& level) {
    // A level that does not exist is reported when the pipeline is compiled.
    const FuncPtr f = level.kind == LoopLevel::Kind::At ? func_or_none(level.func) : nullptr;
    if (!f) return;
    level.func = f->name;
    std::vector<std::string> loops;
    for (int s = 0; s < f->stage_count(); ++s) {
      if (level.stage < 0 || level.stage == s) add_loops(f->stage(s).schedule, loops);
    }
    level.var = loop_of(loops, level.var);
  }

  // Parameters that only the schedule reads belong to the log; those parsed from text are new.
  void note_parameters(const Expr& e) {
    if (!e.defined()) return;
    walk(e, [&](const Variable& v) {
      if (v.symbol.defined() || names_.parameters.count(v.name) ||
          names_.buffer_of_metadata(v.name))
        return;
      const auto parameter = std::make_shared<ParameterContents>();
      parameter->name = v.name;
      parameter->type = v.type;
      names_.parameters.emplace(v.name, parameter);
    });
  }

  NamedEntities names_;
  std::map<std::string, FuncPtr> created_;  // by directives of the log
  NameGroups in_log_, in_program_;
};

}  // namespace

void apply_log(const ScheduleLog& log, const std::vector<FuncPtr>& outputs) {
  Replay replay(log, outputs);
  for (const ScheduleLog::Entry& entry : log.entries) replay.give(entry);
}

std::vector<FuncPtr> with_log(const ScheduleLog& log, const std::vector<FuncPtr>& outputs) {
  std::vector<FuncPtr> copies = copy_graph(outputs).outputs;
  apply_log(log, copies);
  return copies;
}

}  // namespace retrograde::graph
