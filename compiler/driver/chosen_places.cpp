#include "driver/chosen_places.h"

#include <algorithm>
#include <string>

#include "diagnostics/error.h"
#include "graph/directives/give_directive.h"
#include "transform/large_bodies.h"
#include "transform/placement_limits.h"

namespace retrograde::driver {

namespace {

constexpr size_t most_names = 12;  // that a message lists

std::string asked_for(const std::string& what, const std::string& name) {
  return what + " " + quoted(name) + " as the options of the autoscheduler say";
}

class PlaceFinder {
 public:
  explicit PlaceFinder(const std::vector<FuncPtr>& outputs)
      : outputs_(outputs),
        order_(topological_order(outputs)),
        limits_(transform::placement_limits(order_)) {}

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
    if (std::ranges::find(outputs_, &f, &FuncPtr::get) != outputs_.end()) return "it is an output";
    if (f.is_extern()) return "it is an extern stage";
    if (!f.is_pure()) return text("it has ", f.updates.size(), " updates");
    if (limits_.need_root.contains(&f)) return "an extern stage reads it";
    if (limits_.levels.contains(&f)) return "a schedule names one of its loops";
    return "";
  }

  const std::vector<FuncPtr>& outputs_;
  const std::vector<FuncPtr> order_;
  const transform::PlacementLimits limits_;
};

bool is_among(const FuncPtr& f, const std::vector<FuncPtr>& some) {
  return std::ranges::find(some, f) != some.end();
}

// Refuses to inline bodies that would be copied without end.
void check_inlined_bodies(const std::vector<FuncPtr>& outputs,
                          const std::vector<FuncPtr>& inlined) {
  std::vector<FuncPtr> has_place;  // all that a schedule may store
  for (const FuncPtr& f : topological_order(outputs)) {
    if (!is_among(f, inlined)) has_place.push_back(f);
  }
  for (const FuncPtr& f : transform::large_bodies(outputs, has_place)) {
    user_error(
        asked_for("inline", f->name), "what is inlined stays small enough to compile",
        "with what is inlined into it, it is copied to several readers and grows without end",
        "Leave it out of the list, or store what it reads");
  }
}

}  // namespace

void check_chosen_places(const std::vector<FuncPtr>& outputs, const AutoscheduleOptions& options) {
  if (options.store.empty() && options.inlined.empty()) return;
  const PlaceFinder finder(outputs);
  std::vector<FuncPtr> stored, inlined;
  for (const FuncName& named : options.store) {
    if (const FuncPtr f = finder.find("store", named.name)) {
      finder.check_stored(f);
      stored.push_back(f);
    }
  }
  for (const FuncName& named : options.inlined) {
    const FuncPtr f = finder.find("inline", named.name);
    if (!f) continue;
    if (is_among(f, stored)) {
      user_error(asked_for("inline", f->name), "a Func is stored or inlined",
                 "it is among those to store, too", "Take it out of one of the lists");
    }
    finder.check_inlined(f);
    inlined.push_back(f);
  }
  if (!inlined.empty()) check_inlined_bodies(outputs, inlined);
}

}  // namespace retrograde::driver
