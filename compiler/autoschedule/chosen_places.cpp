#include "autoschedule/chosen_places.h"

#include <algorithm>
#include <string>

#include "diagnostics/error.h"
#include "graph/directives/give_directive.h"

namespace retrograde::autoschedule {

namespace {

constexpr size_t most_names = 12;  // that a message lists

std::string asked_for(const std::string& what, const std::string& name) {
  return what + " " + quoted(name) + " as the options of the autoscheduler say";
}

class PlaceFinder {
 public:
  PlaceFinder(const std::vector<FuncPtr>& outputs, const PlacementLimits& limits)
      : outputs_(outputs), order_(topological_order(outputs)), limits_(limits) {}

  // nullptr: it has a directive.
  FuncPtr find(const std::string& what, const std::string& name) const {
    const auto found = std::find_if(order_.begin(), order_.end(),
                                    [&](const FuncPtr& f) { return f->name == name; });
    if (found == order_.end()) {
      const size_t shown = std::min(order_.size(), most_names);
      const std::vector<FuncPtr> some(order_.end() - static_cast<std::ptrdiff_t>(shown),
                                      order_.end());
      user_error(asked_for(what, name), "options of the autoscheduler name Funcs of the pipeline",
                 text("of its ", order_.size(), " Funcs none is called so; the last are ",
                      listed(some, [](const FuncPtr& f) { return quoted(f->name); })),
                 "Name one of them, or give the Func itself");
    }
    return has_directives(**found) ? nullptr : *found;
  }

  void check_stored(const FuncPtr& f) const {
    if (!limits_.stay.contains(f.get())) return;
    user_error(asked_for("store", f->name), "what is stored has bounds that are known",
               "data or an outer loop decide at which places it is read, or loops that it has a "
               "part in",
               "Leave it inline, or clamp the places");
  }

  void check_inlined(const FuncPtr& f) const {
    const std::string evidence = why_not_inlined(*f);
    if (evidence.empty()) return;
    user_error(asked_for("inline", f->name),
               "what is inlined has one pure definition and is no output", evidence,
               "Leave it out of the list: it is stored");
  }

 private:
  std::string why_not_inlined(const FuncContents& f) const {
    if (std::any_of(outputs_.begin(), outputs_.end(),
                    [&](const FuncPtr& output) { return output.get() == &f; }))
      return "it is an output";
    if (f.is_extern()) return "it is an extern stage";
    if (!f.is_pure()) return text("it has ", f.updates.size(), " updates");
    if (limits_.need_root.contains(&f)) return "an extern stage reads it";
    if (limits_.levels.contains(&f)) return "a schedule names one of its loops";
    return "";
  }

  const std::vector<FuncPtr>& outputs_;
  const std::vector<FuncPtr> order_;
  const PlacementLimits& limits_;
};

}  // namespace

bool has_chosen_places(const AutoscheduleOptions& options) {
  return !options.store.empty() || !options.inlined.empty();
}

ChosenPlaces chosen_places(const std::vector<FuncPtr>& outputs, const PlacementLimits& limits,
                           const AutoscheduleOptions& options) {
  ChosenPlaces chosen;
  if (!has_chosen_places(options)) return chosen;
  const PlaceFinder finder(outputs, limits);
  for (const FuncName& named : options.store) {
    if (const FuncPtr f = finder.find("store", named.name)) {
      finder.check_stored(f);
      chosen.store.insert(f.get());
    }
  }
  for (const FuncName& named : options.inlined) {
    const FuncPtr f = finder.find("inline", named.name);
    if (!f) continue;
    if (chosen.store.contains(f.get())) {
      user_error(asked_for("inline", f->name), "a Func is stored or inlined",
                 "it is among those to store, too", "Take it out of one of the lists");
    }
    finder.check_inlined(f);
    chosen.inlined.insert(f.get());
  }
  return chosen;
}

std::unordered_set<const Symbol*> with_names(const std::vector<FuncPtr>& outputs,
                                             const std::set<std::string>& names) {
  std::unordered_set<const Symbol*> result;
  if (names.empty()) return result;
  for (const FuncPtr& f : topological_order(outputs)) {
    if (names.contains(f->name)) result.insert(f.get());
  }
  return result;
}

void check_inlined_bodies(const ChosenPlaces& chosen, const std::vector<FuncPtr>& large) {
  for (const FuncPtr& f : large) {
    if (!chosen.inlined.contains(f.get())) continue;
    user_error(
        asked_for("inline", f->name), "what is inlined stays small enough to compile",
        "with what is inlined into it, it is copied to several readers and grows without end",
        "Leave it out of the list, or store what it reads");
  }
}

}  // namespace retrograde::autoschedule
