// directive_names.h -- the names and expressions of a directive, whichever it is.
#pragma once

#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "graph/directive.h"
#include "ir/visit.h"

namespace retrograde::graph {

// Calls `visit` with every name and every expression of a directive, by reference.
template <typename Visit>
class NameVisitor {
 public:
  explicit NameVisitor(const Visit& visit) : visit_(visit) {}
  void operator()(Directive& directive) {
    std::visit(
        [&](auto& d) { std::apply([&](auto&... field) { (look(field), ...); }, d.fields()); },
        directive);
  }

 private:
  template <typename T>
  void look(T& field) {
    if constexpr (std::is_invocable_v<const Visit&, T&>) visit_(field);
  }
  template <typename A, typename B>
  void look(std::pair<A, B>& both) {
    look(both.first);
    look(both.second);
  }
  template <typename T>
  void look(std::vector<T>& list) {
    for (T& one : list) look(one);
  }
  const Visit& visit_;
};

template <typename Visit>
void visit_names(Directive& directive, const Visit& visit) {
  NameVisitor<Visit>{visit}(directive);
}

}  // namespace retrograde::graph
