#include "graph/directives/schedule_log.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <set>

#include "diagnostics/error.h"
#include "graph/copy_graph.h"
#include "graph/definitions/rfactor.h"
#include "graph/directives/directive_fields.h"
#include "graph/directives/directive_text.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/wrappers.h"
#include "graph/graph.h"
#include "graph/names.h"
#include "graph/text/binder.h"
#include "graph/text/graph_lines.h"
#include "ir/build.h"
#include "ir/text.h"
#include "ir/visit.h"

namespace retrograde {

namespace graph {

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
      if (v.symbol.defined() || names_.parameters.count(v.name) || names_.buffer_of_fact(v.name))
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

void add_places(const FuncContents& f, std::map<std::string, size_t>& places) {
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (f.args[d].find('$') != std::string::npos) places.emplace(f.args[d], d);
  }
  for (const Definition& update : f.updates) {
    for (size_t i = 0; i < update.rvars.size(); ++i) places.emplace(update.rvars[i].var, i);
  }
}

}  // namespace

ScheduleLog schedule_log(const std::vector<FuncPtr>& outputs) {
  ScheduleLog log;
  std::multimap<uint64_t, ScheduleLog::Entry> ordered;
  for (const FuncPtr& f : functions_of(outputs)) {
    add_places(*f, log.places);
    for (const LoggedDirective& logged : f->log) {
      ScheduleLog::Entry entry{f->name, logged.stage, logged.special, logged.directive};
      std::visit(
          []<typename D>(D& d) {
            if constexpr (std::is_base_of_v<AtLevel, D>) {
              if (d.from && d.from->defined) d.level = d.from->level;
              d.from = nullptr;
            }
          },
          entry.directive);
      ordered.emplace(logged.order, std::move(entry));
    }
  }
  for (auto& [order, entry] : ordered) log.entries.push_back(std::move(entry));
  return log;
}

void apply_log(const ScheduleLog& log, const std::vector<FuncPtr>& outputs) {
  Replay replay(log, outputs);
  for (const ScheduleLog::Entry& entry : log.entries) replay.give(entry);
}

std::vector<FuncPtr> with_log(const ScheduleLog& log, const std::vector<FuncPtr>& outputs) {
  std::vector<FuncPtr> copies = copy_graph(outputs).outputs;
  apply_log(log, copies);
  return copies;
}

}  // namespace graph

// ---- text ----

namespace {

using namespace graph;

// The prefix "blur.update(0).specialization(1)."
std::string place_text(const ScheduleLog::Entry& entry) {
  std::string out = quote_name(entry.func) + ".";
  if (entry.stage > 0) out += text("update(", entry.stage - 1, ").");
  for (const int step : entry.special) out += text("specialization(", step, ").");
  return out;
}

// Consumes "word(7)." at the beginning.
bool take(std::string& rest, const std::string& word, int& number) {
  if (rest.rfind(word + "(", 0) != 0) return false;
  const size_t begin = word.size() + 1, end = rest.find(").", begin);
  if (end == std::string::npos || end == begin || end > begin + 6 ||
      rest.find_first_not_of("0123456789", begin) != end)
    return false;
  number = std::stoi(rest.substr(begin, end - begin));
  rest.erase(0, end + 2);
  return true;
}

ScheduleLog::Entry parse_entry(const Line& line) {
  const size_t quote = line.content[0] == '`' ? line.content.find('`', 1) : 0;
  const size_t dot = line.content.find('.', quote == std::string::npos ? 0 : quote);
  if (dot != std::string::npos && dot > 0) {
    const bool is_quoted = line.content[0] == '`';
    ScheduleLog::Entry entry{
        is_quoted ? line.content.substr(1, dot - 2) : line.content.substr(0, dot), -1, {}, {}};
    std::string rest = line.content.substr(dot + 1);
    int number = -1;
    take(rest, "update", number);
    for (int step = 0; take(rest, "specialization", step);) entry.special.push_back(step);
    if (const auto directive = parse_directive(rest)) {
      entry.directive = *directive;
      if (is_of_stage(*directive) || number >= 0) entry.stage = number + 1;
      return entry;
    }
  }
  user_error("read the text of a schedule log", "every line is a directive of a Func",
             text("line ", line.number, " says ", quoted(line.content)),
             "Write it as to_text() does");
}

}  // namespace

bool ScheduleLog::Entry::operator==(const Entry& other) const {
  return func == other.func && stage == other.stage && special == other.special &&
         graph::equal(directive, other.directive);
}

std::string ScheduleLog::to_text() const {
  std::string out;
  for (const Entry& entry : entries)
    out += place_text(entry) + graph::to_text(entry.directive) + "\n";
  return out;
}

ScheduleLog ScheduleLog::parse(const std::string& text) {
  ScheduleLog log;
  for (const Line& line : lines_of(text)) log.entries.push_back(parse_entry(line));
  return log;
}

ScheduleLog ScheduleLog::first(size_t count) const {
  ScheduleLog log = *this;
  log.entries.resize(std::min(count, entries.size()));
  return log;
}
ScheduleLog ScheduleLog::of(const std::string& func) const {
  ScheduleLog log = *this;
  std::erase_if(log.entries, [&](const Entry& entry) { return entry.func != func; });
  return log;
}

namespace {

bool mentions(const ScheduleLog::Entry& entry, const std::string& name) {
  bool found = entry.func == name;
  Directive copy = entry.directive;
  visit_names(copy, Overloaded{[&](NamedFunc& f) { found |= f == name; },
                               [&](graph::LoopLevel& level) { found |= level.func == name; }});
  return found;
}

bool is_below(const ScheduleLog::Entry& entry, const ScheduleLog::Entry& place) {
  return entry.func == place.func && entry.stage == place.stage &&
         entry.special.size() >= place.special.size() &&
         std::equal(place.special.begin(), place.special.end(), entry.special.begin());
}

// Maps each loop that a removed directive creates to the loop that it replaced, or to none ("").
std::map<std::string, std::string> loops_without(const Directive& directive) {
  std::map<std::string, std::string> loops;
  if (const auto* split = std::get_if<SplitLoop>(&directive)) {
    loops = {{split->inner, ""}};
    loops[split->outer] = split->old;
  } else if (const auto* fuse = std::get_if<FuseLoops>(&directive)) {
    loops[fuse->fused] = fuse->inner;
  } else if (const auto* rename = std::get_if<RenameLoop>(&directive)) {
    loops[rename->renamed] = rename->old;
  }
  return loops;
}

// Returns whether everything that the directive names still exists.
bool rename_loops(Directive& directive, const ScheduleLog::Entry& removed, bool is_stage,
                  const std::map<std::string, std::string>& loops) {
  bool is_whole = true;
  const auto rename = [&](std::string& name) {
    const auto found = loops.find(name);
    if (found == loops.end()) return;
    is_whole &= !found->second.empty();
    name = found->second;
  };
  if (auto* reorder = std::get_if<ReorderLoops>(&directive); reorder && is_stage) {
    std::erase_if(reorder->loops, [&](const NamedLoop& loop) {
      const auto found = loops.find(loop);
      return found != loops.end() && found->second.empty();
    });
  }
  visit_names(directive, Overloaded{[&](NamedLoop& loop) {
                                      if (is_stage) rename(loop);
                                    },
                                    [&](graph::LoopLevel& level) {
                                      if (level.func == removed.func) rename(level.var);
                                    }});
  return is_whole;
}

}  // namespace

ScheduleLog ScheduleLog::without(size_t index) const {
  const Entry& removed = entries[index];
  ScheduleLog log = first(index);
  const std::string created = made_by(removed.directive);
  const bool is_factored = std::holds_alternative<FactorOut>(removed.directive);
  const auto loops = loops_without(removed.directive);
  int special = -1;  // the index of the removed specialization
  if (std::holds_alternative<Specialize>(removed.directive)) {
    special = static_cast<int>(std::ranges::count_if(log.entries, [&](auto& e) {
      return e.directive.index() == removed.directive.index() && e.func == removed.func &&
             e.stage == removed.stage && e.special == removed.special;
    }));
  }
  for (size_t i = index + 1; i < entries.size(); ++i) {
    Entry entry = entries[i];
    const bool is_stage = is_below(entry, removed);
    if (!created.empty() && (mentions(entry, created) || (is_factored && is_stage))) continue;
    if (special >= 0 && is_stage && entry.special.size() > removed.special.size()) {
      int& step = entry.special[removed.special.size()];
      if (step == special) continue;
      if (step > special) --step;
    }
    if (rename_loops(entry.directive, removed, is_stage, loops)) log.entries.push_back(entry);
  }
  return log;
}

}  // namespace retrograde
