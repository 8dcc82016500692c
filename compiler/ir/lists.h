// Lists made of lists.
#pragma once

#include <functional>
#include <type_traits>
#include <vector>

namespace retrograde::ir {

// What `f`, a function or a member, gives of each, in order.
template <class List, class F>
auto mapped(const List& list, F&& f) {
  std::vector<std::decay_t<decltype(std::invoke(f, *list.begin()))>> result;
  for (const auto& one : list) result.push_back(std::invoke(f, one));
  return result;
}

// f(0), ..., f(count - 1)
template <class F>
auto numbered(size_t count, F&& f) {
  std::vector<std::decay_t<decltype(f(count))>> result;
  for (size_t i = 0; i < count; ++i) result.push_back(f(i));
  return result;
}

template <class T>
void append(std::vector<T>& list, const std::vector<T>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

}  // namespace retrograde::ir
