#include "autoschedule/schedule_search.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>

#include "autoschedule/stored_funcs.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "graph/directives/give_directive.h"

namespace retrograde::autoschedule {

namespace {

constexpr size_t beam = 3;         // schedules that a step goes on from
constexpr int most_doublings = 2;  // or halvings, of a number of the rules
constexpr size_t most_places = 6;  // Funcs whose place is varied
constexpr size_t most_tried = 96, fewest_tried = 12;
constexpr size_t most_threads = 4;    // that predict
constexpr size_t funcs_tried = 2000;  // in all schedules together

bool is_of_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$';
}

}  // namespace

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

namespace {

// work(i) for each i below `count`, by several threads.
void in_parallel(size_t count, const std::function<void(size_t)>& work) {
  std::atomic<size_t> next{0};
  const auto run = [&] {
    for (size_t i = next++; i < count; i = next++) work(i);
  };
  const size_t threads = std::min<size_t>(std::thread::hardware_concurrency(), most_threads);
  std::vector<std::thread> others;
  for (size_t i = 1; i < std::min(threads, count); ++i)
    others.emplace_back([&] { run_on_large_stack(run); });
  run();
  for (std::thread& other : others) other.join();
}

// One decision, number or place otherwise; a user's own are left.
class SearchSteps {
 public:
  // false: the request has it.
  using Step = std::function<bool(ScheduleRequest&)>;

  SearchSteps(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request) {
    for (Decision decision : all_decisions())
      steps_.emplace_back(
          [decision](auto& r) { return r.options.without.insert(decision).second; });
    for (int ScheduleScales::*scale : {&ScheduleScales::register_tile, &ScheduleScales::tasks,
                                       &ScheduleScales::strip_rows, &ScheduleScales::caches}) {
      for (const int doublings : {-1, 1}) {
        steps_.emplace_back([scale, doublings](auto& r) {
          return std::abs(r.scales.*scale += doublings) <= most_doublings;
        });
      }
    }
    for (const std::string& name : places_of(outputs, request)) {
      steps_.emplace_back([name](auto& r) {
        r.stored.erase(name);
        return r.recomputed.insert(name).second;
      });
      steps_.emplace_back([name](auto& r) {
        r.recomputed.erase(name);
        return r.stored.insert(name).second;
      });
    }
  }

  size_t count() const { return steps_.size(); }
  std::optional<ScheduleRequest> from(ScheduleRequest request, size_t step) const {
    return steps_[step](request) ? std::optional(std::move(request)) : std::nullopt;
  }
  // All but those that change nothing: in this program they are unlikely to later.
  void keep(const std::vector<bool>& changes) {
    size_t at = 0;
    std::erase_if(steps_, [&](const Step&) { return !changes[at++]; });
  }

 private:
  // Untouched pure Funcs by what their place decides: operations done again, or bytes.
  static std::vector<std::string> places_of(const std::vector<FuncPtr>& outputs,
                                            const ScheduleRequest& request) {
    const SizeEstimate sizes(outputs);
    const auto uses = uses_of_stored(outputs, {});
    std::vector<std::pair<double, std::string>> weights;
    for (const FuncPtr& f : topological_order(outputs)) {
      const bool is_output = std::find(outputs.begin(), outputs.end(), f) != outputs.end();
      if (!f->is_pure() || has_directives(*f) || is_output || is_said(request, f->name)) continue;
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

  std::vector<Step> steps_;
};

class Search {
 public:
  Search(const std::vector<FuncPtr>& outputs, const ScheduleRequest& request, Scheduling what,
         const ScheduleCost& cost, size_t candidates)
      : outputs_(outputs), what_(what), cost_(cost), left_(candidates), steps_(outputs, request) {
    SearchedSchedule rules = scheduled(request);
    rules.cost = cost_(rules.graph.outputs);
    for (const FuncPtr& f : topological_order(outputs)) names_.insert(f->name);
    most_bytes_ = std::max(rules.graph.memory.bytes, rules.graph.memory.budget_bytes);
    result_.cost_of_rules = rules.cost;
    result_.rules = rules;
    seen_.insert(text_of(rules));
    asked_.insert(key_of(request));
    keep(std::move(rules));
  }

  ScheduleSearch run() {
    std::vector<SearchedSchedule> front{best_[0]};
    while (left_ > 0 && !front.empty()) {
      const double before = best_[0].cost;
      std::vector<SearchedSchedule> next;
      for (const SearchedSchedule& from : front) try_all(from.request, next);
      std::stable_sort(next.begin(), next.end(), is_less);
      if (next.size() > beam) next.resize(beam);
      front = best_[0].cost < before ? std::move(next) : std::vector<SearchedSchedule>();
    }
    result_.best = made_again(best_[0]);
    if (best_.size() > 1) result_.runner_up = made_again(best_[1]);
    result_.rules = made_again(result_.rules);
    return std::move(result_);
  }

 private:
  static bool is_less(const SearchedSchedule& a, const SearchedSchedule& b) {
    return a.cost < b.cost;
  }
  SearchedSchedule scheduled(const ScheduleRequest& request) const {
    return {schedule_within_budget(outputs_, request, what_), request};
  }
  // Threads share the numbers of names: one after the other they are the same each time.
  SearchedSchedule made_again(const SearchedSchedule& known) const {
    SearchedSchedule result = scheduled(known.request);
    result.cost = known.cost;
    return result;
  }
  std::string text_of(const SearchedSchedule& s) const {
    return with_stable_names(schedule_log(s.graph.outputs), names_);
  }
  static std::string key_of(const ScheduleRequest& r) {
    std::string key = r.options.to_string();
    for (const auto& [mark, names] : {std::pair("-", &r.recomputed), std::pair("+", &r.stored)}) {
      for (const std::string& name : *names) key += mark + name;
    }
    const ScheduleScales& s = r.scales;
    return text(key, " ", s.register_tile, " ", s.tasks, " ", s.strip_rows, " ", s.caches);
  }

  // A step from a schedule.
  struct Tried {
    size_t step;
    ScheduleRequest request;
    std::optional<SearchedSchedule> schedule;  // none: it cannot be given
    std::string log;
  };

  // Those that are new, as far as there are some left to try, in the order of the steps.
  void try_all(const ScheduleRequest& from, std::vector<SearchedSchedule>& next) {
    std::vector<Tried> tried = schedules_from(from);
    std::vector<SearchedSchedule> candidates;
    for (Tried& t : tried) {
      if (!t.schedule || !seen_.insert(t.log).second || left_ == 0) continue;
      if (t.schedule->graph.memory.bytes > most_bytes_) continue;
      candidates.push_back(*std::move(t.schedule));
      --left_;
    }
    in_parallel(candidates.size(), [&](size_t i) {
      try {
        candidates[i].cost = cost_(candidates[i].graph.outputs);
      } catch (const std::exception&) {  // it cannot be lowered
      }
    });
    for (SearchedSchedule& candidate : candidates) {
      if (std::isinf(candidate.cost)) continue;
      next.push_back(candidate);
      keep(std::move(candidate));
    }
  }

  std::vector<Tried> schedules_from(const ScheduleRequest& from) {
    std::vector<Tried> tried;
    for (size_t step = 0; step < steps_.count(); ++step) {
      auto request = steps_.from(from, step);
      if (request && asked_.insert(key_of(*request)).second)
        tried.push_back({step, *std::move(request), std::nullopt, ""});
    }
    in_parallel(tried.size(), [&](size_t i) {
      try {
        tried[i].schedule = scheduled(tried[i].request);
        tried[i].log = text_of(*tried[i].schedule);
      } catch (const std::exception&) {  // that of the rules can be given
      }
    });
    if (std::exchange(is_first_, false)) drop_idle_steps(tried);
    return tried;
  }
  void drop_idle_steps(const std::vector<Tried>& tried) {
    std::vector<bool> changes(steps_.count(), false);
    for (const Tried& t : tried) changes[t.step] = t.schedule && !seen_.contains(t.log);
    steps_.keep(changes);
  }

  // The two best.
  void keep(SearchedSchedule candidate) {
    ++result_.tried;
    best_.push_back(std::move(candidate));
    std::stable_sort(best_.begin(), best_.end(), is_less);
    if (best_.size() > 2) best_.pop_back();
  }

  const std::vector<FuncPtr>& outputs_;
  const Scheduling what_;
  const ScheduleCost& cost_;
  size_t left_;
  SearchSteps steps_;
  bool is_first_ = true;
  int64_t most_bytes_ = 0;
  std::set<std::string> names_;         // of the graph without a schedule
  std::set<std::string> asked_, seen_;  // requests, logs
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
