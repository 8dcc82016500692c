// interval.h -- Halide's Interval, Scope and bounds_of_expr_in_scope.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::porting {

// [min, max]; an unbounded end is neg_inf() or pos_inf(). nothing() is empty.
struct Interval {
  Expr min = pos_inf(), max = neg_inf();

  Interval() = default;
  Interval(const Expr& min, const Expr& max) : min(min), max(max) {}

  static Expr pos_inf();
  static Expr neg_inf();
  static Interval everything() { return {neg_inf(), pos_inf()}; }
  static Interval nothing() { return {}; }
  static Interval single_point(const Expr& e) { return {e, e}; }

  bool has_lower_bound() const { return !min.same_as(neg_inf()) && !is_empty(); }
  bool has_upper_bound() const { return !max.same_as(pos_inf()) && !is_empty(); }
  bool is_bounded() const { return has_lower_bound() && has_upper_bound(); }
  bool is_everything() const { return min.same_as(neg_inf()) && max.same_as(pos_inf()); }
  bool is_empty() const { return min.same_as(pos_inf()) || max.same_as(neg_inf()); }
  bool is_single_point() const { return min.same_as(max); }
  bool is_single_point(const Expr& e) const { return min.same_as(e) && max.same_as(e); }
  bool can_prove_is_single_point() const;
  bool same_as(const Interval& other) const {
    return min.same_as(other.min) && max.same_as(other.max);
  }
  bool operator==(const Interval& other) const;  // structural
  void include(const Interval& other) { *this = make_union(*this, other); }
  void include(const Expr& e) { include(single_point(e)); }

  static Expr make_max(const Expr& a, const Expr& b);
  static Expr make_min(const Expr& a, const Expr& b);
  static Interval make_union(const Interval& a, const Interval& b);
  static Interval make_intersection(const Interval& a, const Interval& b);
};

// Maps names to values; the last value pushed for a name wins.
template <typename T = void>
class Scope {
 public:
  Scope() = default;
  static const Scope& empty_scope() {
    static const Scope empty;
    return empty;
  }
  // Names that are not in this scope are looked up in `outer`, which must outlive it.
  void set_containing_scope(const Scope* outer) { outer_ = outer; }

  template <typename... Value>
  requires(sizeof...(Value) == (std::is_void_v<T> ? 0 : 1)) void push(const std::string& name,
                                                                      Value&&... value) {
    table_[name].emplace_back(std::forward<Value>(value)...);
  }
  void pop(const std::string& name) {
    const auto found = table_.find(name);
    if (found == table_.end()) refuse(name);
    found->second.pop_back();
    if (found->second.empty()) table_.erase(found);
  }
  bool contains(const std::string& name) const { return found(name) != nullptr; }
  size_t count(const std::string& name) const {
    const auto here = table_.find(name);
    return (here == table_.end() ? 0 : here->second.size()) + (outer_ ? outer_->count(name) : 0);
  }
  size_t size() const { return table_.size(); }
  bool empty() const { return table_.empty(); }
  const auto& get(const std::string& name) const requires(!std::is_void_v<T>) {
    const Stored* value = found(name);
    if (!value) refuse(name);
    return *value;
  }
  const auto* find(const std::string& name) const requires(!std::is_void_v<T>) {
    return found(name);
  }
  // Visits every name with its last value.
  template <typename Visit>
  void for_each(const Visit& visit) const requires(!std::is_void_v<T>) {
    if (outer_) outer_->for_each(visit);
    for (const auto& [name, values] : table_) visit(name, values.back());
  }

 private:
  struct Nothing {};
  using Stored = std::conditional_t<std::is_void_v<T>, Nothing, T>;
  const Stored* found(const std::string& name) const {
    const auto here = table_.find(name);
    if (here != table_.end()) return &here->second.back();
    return outer_ ? outer_->found(name) : nullptr;
  }
  [[noreturn]] static void refuse(const std::string& name) {
    user_error("look up " + retrograde::quoted(name) + " in a Scope",
               "a name is pushed before it is looked up", "it was not pushed",
               "Ask contains() first");
  }
  std::map<std::string, std::vector<Stored>> table_;
  const Scope* outer_ = nullptr;
};

// Binds a name during its lifetime.
template <typename T = void>
class ScopedBinding {
 public:
  template <typename... Value>
  ScopedBinding(Scope<T>& scope, const std::string& name, Value&&... value)
      : scope_(scope), name_(name) {
    scope.push(name, std::forward<Value>(value)...);
  }
  ~ScopedBinding() { scope_.pop(name_); }
  ScopedBinding(const ScopedBinding&) = delete;
  ScopedBinding& operator=(const ScopedBinding&) = delete;

 private:
  Scope<T>& scope_;
  const std::string name_;
};

// The range of the expression when variables range over the intervals in `scope`; all other
// variables are symbols. With `constant_bounds`, an end that is not constant becomes unbounded.
Interval bounds_of_expr_in_scope(const Expr& e, const Scope<Interval>& scope,
                                 bool constant_bounds = false);
Expr simplify(const Expr& e, const Scope<Interval>& bounds);
bool can_prove(const Expr& condition, const Scope<Interval>& bounds);

}  // namespace retrograde::porting
