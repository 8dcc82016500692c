#include "graph/directives/schedule_log.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "graph/directives/directive_fields.h"
#include "graph/directives/directive_text.h"
#include "graph/directives/wrappers.h"
#include "graph/text/graph_lines.h"
#include "ir/text.h"

namespace retrograde {

namespace graph {

namespace {

void add_places(const FuncContents& f, std::map<std::string, size_t>& places) {
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (f.args[d].find('$') != std::string::npos) places.emplace(f.args[d], d);
  }
  for (const Definition& update : f.updates) {
    for (size_t i = 0; i < update.rvars.size(); ++i) {
      const std::string& var = update.rvars[i].var;
      const bool has_dot = var.find('.') != std::string::npos;  // variables of users' RDoms have
      places.emplace(has_dot ? var : "." + var, i);
    }
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
