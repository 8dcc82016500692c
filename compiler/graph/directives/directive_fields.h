// directive_fields.h -- visits the fields of a directive, whichever it is, in the order of its text.
// Printing, parsing, binding and renaming use this one traversal.
#pragma once

#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "graph/directives/directive.h"

namespace retrograde::graph {

// Calls `visit` with every name, expression, enumerator, flag and loop level, by reference. Pairs
// and lists are visited element by element. After its last element a list is extended as long as
// `has_more` returns true, so that parsing can fill it.
template <typename Visit, typename HasMore>
class FieldVisitor {
 public:
  FieldVisitor(const Visit& visit, const HasMore& has_more) : visit_(visit), has_more_(has_more) {}
  template <typename D>
  void fields_of(D& directive) const {
    std::apply([&](auto&... field) { (element(field), ...); }, directive.fields());
  }

 private:
  template <typename T>
  void element(T& field) const {
    visit_(field);
  }
  template <typename A, typename B>
  void element(std::pair<A, B>& both) const {
    element(both.first);
    element(both.second);
  }
  template <typename T>
  void element(std::vector<T>& list) const {
    for (T& one : list) element(one);
    while (has_more_()) element(list.emplace_back());
  }
  const Visit& visit_;
  const HasMore& has_more_;
};

inline constexpr auto is_complete = [] { return false; };

// The fields of one type of directive.
template <typename D, typename Visit>
void visit_fields(D& directive, const Visit& visit) {
  FieldVisitor{visit, is_complete}.fields_of(directive);
}

// The names and expressions of a directive: those fields that `visit` accepts.
template <typename Visit>
void visit_names(Directive& directive, const Visit& visit) {
  const auto visit_accepted = [&]<typename T>(T& field) {
    if constexpr (std::is_invocable_v<const Visit&, T&>) visit(field);
  };
  std::visit([&](auto& d) { visit_fields(d, visit_accepted); }, directive);
}

}  // namespace retrograde::graph
