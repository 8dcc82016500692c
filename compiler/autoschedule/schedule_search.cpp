#include "autoschedule/schedule_search.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <sstream>
#include <utility>

#include "autoschedule/stored_funcs.h"
#include "diagnostics/error.h"
#include "graph/give_directive.h"

namespace retrograde::autoschedule {

namespace {

constexpr size_t beam = 3;         // schedules that a step goes on from
constexpr int most_doublings = 2;  // or halvings, of a number of the rules
constexpr size_t most_places = 6;  // Funcs whose place is varied
constexpr size_t most_tried = 96, fewest_tried = 12;
constexpr size_t funcs_tried = 6000;  // in all schedules together

bool is_of_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$';
}

// Funcs that a schedule makes have another number in each copy of a graph: all names but those known
// are numbered anew, in their order; the first of a name in the process has no number yet.
std::string with_stable_names(const ScheduleLog& log, const std::set<std::string>& known) {
  const std::string text = log.to_text();
  std::set<std::string> made;
  for (const ScheduleLog::Entry& entry : log.entries) made.insert(made_by(entry.directive));
  std::map<std::string, std::map<std::string, size_t>> numbers;
  std::string result;
  for (size_t at = 0; at < text.size();) {
    size_t end = at;
    while (end < text.size() && is_of_name(text[end])) ++end;
    const std::string name = text.substr(at, end - at);
    const size_t dollar = name.find('$');
    if (end == at) {
      result += text[end++];
    } else if (known.contains(name) || (dollar == std::string::npos && !made.contains(name))) {
      result += name;
    } else {
      const std::string plain = name.substr(0, dollar);
      auto& seen = numbers[plain];
      result += plain + "$" + std::to_string(seen.emplace(name, seen.size() + 1).first->second);
    }
    at = end;
  }
  return result;
}

class Search {
 public:
  Search(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request, Scheduling what,
         const ScheduleCost& cost, size_t candidates)
      : outputs_(outputs), what_(what), cost_(cost), left_(candidates) {
    SearchedSchedule rules = scheduled(request);
    rules.cost = cost_(rules.graph.outputs);
    for (const FuncPtr& f : topological_order(outputs)) names_.insert(f->name);
    most_bytes_ = std::max(rules.graph.memory.bytes, rules.graph.memory.budget_bytes);
    result_.cost_of_rules = rules.cost;
    result_.rules = rules;
    places_ = places_of(request);
    keep(std::move(rules));
  }

  ScheduleSearch run() {
    std::vector<SearchedSchedule> front{best_[0]};
    while (left_ > 0 && !front.empty()) {
      const double before = best_[0].cost;
      std::vector<SearchedSchedule> next;
      for (const SearchedSchedule& from : front) {
        for (const ScheduleRequest& step : steps_from(from.request)) try_step(step, next);
      }
      std::stable_sort(next.begin(), next.end(), is_less);
      if (next.size() > beam) next.resize(beam);
      front = best_[0].cost < before ? std::move(next) : std::vector<SearchedSchedule>();
    }
    result_.best = std::move(best_[0]);
    if (best_.size() > 1) result_.runner_up = std::move(best_[1]);
    return std::move(result_);
  }

 private:
  static bool is_less(const SearchedSchedule& a, const SearchedSchedule& b) {
    return a.cost < b.cost;
  }

  SearchedSchedule scheduled(const ScheduleRequest& request) const {
    return {schedule_within_budget(outputs_, request, what_), request};
  }

  void try_step(const ScheduleRequest& request, std::vector<SearchedSchedule>& next) {
    if (left_ == 0) return;
    try {
      SearchedSchedule candidate = scheduled(request);
      const bool is_new = seen_.insert(text_of(candidate)).second;
      if (!is_new || candidate.graph.memory.bytes > most_bytes_) return;
      --left_;
      candidate.cost = cost_(candidate.graph.outputs);
      next.push_back(candidate);
      keep(std::move(candidate));
    } catch (const Error&) {
      // Cannot be given, or lowered: that of the rules can.
    }
  }

  std::string text_of(const SearchedSchedule& s) const {
    return with_stable_names(schedule_log(s.graph.outputs), names_);
  }

  // The two best.
  void keep(SearchedSchedule candidate) {
    seen_.insert(text_of(candidate));
    ++result_.tried;
    best_.push_back(std::move(candidate));
    std::stable_sort(best_.begin(), best_.end(), is_less);
    if (best_.size() > 2) best_.pop_back();
  }

  // Untouched pure Funcs by what their place decides: operations done again, or bytes.
  std::vector<std::string> places_of(const ScheduleRequest& request) const {
    const SizeEstimate sizes(outputs_);
    const auto uses = uses_of_stored(outputs_, {});
    std::vector<std::pair<double, std::string>> weights;
    for (const FuncPtr& f : topological_order(outputs_)) {
      const bool is_output = std::find(outputs_.begin(), outputs_.end(), f) != outputs_.end();
      if (!f->is_pure() || is_touched(*f) || is_output || is_said(request, f->name)) continue;
      const auto use = uses.find(f.get());
      if (use == uses.end() || use->second.reads <= 1) continue;
      const auto elements = static_cast<double>(sizes.bytes(*f)) / total_bytes(f->types);
      weights.emplace_back(elements * use->second.operations * (use->second.reads - 1), f->name);
    }
    std::stable_sort(weights.begin(), weights.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    if (weights.size() > most_places) weights.resize(most_places);
    return ir::mapped(weights, [](const auto& weight) { return weight.second; });
  }
  static bool is_said(const ScheduleRequest& request, const std::string& name) {
    const auto is_it = [&](const FuncName& named) { return named.name == name; };
    return std::ranges::any_of(request.options.store, is_it) ||
           std::ranges::any_of(request.options.inlined, is_it);
  }

  // One decision, number or place otherwise; a user's own are left.
  std::vector<ScheduleRequest> steps_from(const ScheduleRequest& request) const {
    std::vector<ScheduleRequest> steps;
    for (Decision decision : all_decisions()) {
      ScheduleRequest step = request;
      if (step.options.without.insert(decision).second) steps.push_back(std::move(step));
    }
    for (int ScheduleScales::*scale : {&ScheduleScales::register_tile, &ScheduleScales::tasks,
                                       &ScheduleScales::strip_rows, &ScheduleScales::caches}) {
      for (const int doublings : {-1, 1}) {
        ScheduleRequest step = request;
        step.scales.*scale += doublings;
        if (std::abs(step.scales.*scale) <= most_doublings) steps.push_back(std::move(step));
      }
    }
    for (const std::string& name : places_) {
      ScheduleRequest again = request, stored = request;
      again.stored.erase(name);
      stored.recomputed.erase(name);
      if (again.recomputed.insert(name).second) steps.push_back(std::move(again));
      if (stored.stored.insert(name).second) steps.push_back(std::move(stored));
    }
    return steps;
  }

  const std::vector<FuncPtr>& outputs_;
  const Scheduling what_;
  const ScheduleCost& cost_;
  size_t left_;
  int64_t most_bytes_ = 0;
  std::vector<std::string> places_;
  std::set<std::string> names_;  // of the graph without a schedule
  std::set<std::string> seen_;   // logs
  std::vector<SearchedSchedule> best_;
  ScheduleSearch result_;
};

std::set<std::string> funcs_of(const ScheduleLog& log) {
  std::set<std::string> names;
  for (const ScheduleLog::Entry& entry : log.entries) names.insert(entry.func);
  return names;
}

std::string only_in(const std::string& text, const std::string& other, const char* mark) {
  std::map<std::string, int> known;
  std::istringstream others(other), lines(text);
  for (std::string line; std::getline(others, line);) ++known[line];
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    if (--known[line] < 0) result += mark + line + "\n";
  }
  return result;
}

}  // namespace

size_t candidates_for(size_t funcs) {
  return std::clamp(funcs_tried / std::max<size_t>(funcs, 1), fewest_tried, most_tried);
}

ScheduleSearch search_schedule(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request,
                               Scheduling what, const ScheduleCost& cost, size_t candidates) {
  if (candidates == 0) candidates = candidates_for(topological_order(outputs).size());
  return Search(outputs, request, what, cost, candidates).run();
}

std::string difference_of(const ScheduleLog& first, const ScheduleLog& second) {
  std::set<std::string> both;
  const std::set<std::string> others = funcs_of(second);
  for (const std::string& name : funcs_of(first)) {
    if (others.contains(name)) both.insert(name);
  }
  const std::string a = with_stable_names(first, both);
  const std::string b = with_stable_names(second, both);
  return only_in(a, b, "- ") + only_in(b, a, "+ ");
}

}  // namespace retrograde::autoschedule
