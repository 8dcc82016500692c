// validate_scope.h -- the names and allocations in scope while a program is validated.
#pragma once

#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "diagnostics/error.h"
#include "ir/phase_check.h"

namespace retrograde::ir {

class ValidationScope {
 public:
  using Names = std::unordered_set<std::string>;

  // `free_names` are bound outside of the program.
  ValidationScope(const PhaseCheck& phase, const std::vector<std::string>& free_names)
      : phase_(phase), visible_(free_names.begin(), free_names.end()), bound_(visible_) {}

  // The number of times that names or allocations left the scope. While it stays the same, a valid expression stays
  // valid.
  size_t exits() const { return exits_; }

  // ---- names ----

  bool is_visible(const std::string& name) const { return visible_.count(name) > 0; }

  // Binds a name during its lifetime. `node`: the binding Expr or Stmt.
  class Binding {
   public:
    template <class Node>
    Binding(ValidationScope& scope, const std::string& name, const Node& node)
        : scope_(scope), name_(name) {
      const bool is_new = scope.bound_.insert(name).second;
      if (!is_new && scope.phase_.phase() != Phase::Nests)
        scope.phase_.fail(node, "names are unique: " + quoted(name) + " is bound twice");
      hides_ = !scope.visible_.insert(name).second;
    }
    ~Binding() {
      if (!hides_) scope_.visible_.erase(name_);
      ++scope_.exits_;
    }

   private:
    ValidationScope& scope_;
    const std::string name_;
    bool hides_ = false;  // another binding of the name (Phase::Nests)
  };

  // Makes names visible that a later pass binds, and hides them again.
  void show(const std::vector<std::string>& names) { visible_.insert(names.begin(), names.end()); }
  void hide(const std::vector<std::string>& names) {
    for (const std::string& name : names) visible_.erase(name);
    ++exits_;
  }

  // ---- allocations ----

  void begin_allocation(const std::string& name, const Stmt& allocate) {
    if (!allocated_.insert(name).second)
      phase_.fail(allocate, "names are unique: two allocations are called " + quoted(name));
    live_.insert(name);
  }
  // Ends the allocation, and says whether it was alive.
  bool end_allocation(const std::string& name) {
    ++exits_;
    return live_.erase(name) > 0;
  }
  template <class Node>
  void check_alive(const std::string& name, const Node& access) const {
    if (allocated_.count(name) && !live_.count(name)) {
      phase_.fail(access, "an allocation is used inside its Allocate and before its Free: " +
                              quoted(name) + " is not alive");
    }
  }

  // Checks two branches, only one of which runs. A Free in one of them ends the allocation for everything after both.
  template <class First, class Second>
  void check_branches(First&& check_first, Second&& check_second) {
    const Names before = live_;
    check_first();
    const Names after_first = std::exchange(live_, before);
    ++exits_;
    check_second();
    std::erase_if(live_, [&](const std::string& name) { return !after_first.count(name); });
  }

 private:
  const PhaseCheck& phase_;
  Names visible_, bound_;   // bound_: so far, in the whole program
  Names allocated_, live_;  // all allocations so far; those alive here
  size_t exits_ = 0;
};

}  // namespace retrograde::ir
