// Helpers that map and filter lists and look up keys of maps. expr.h includes this file.
#pragma once

#include <functional>
#include <type_traits>
#include <vector>

namespace retrograde::ir {

// `f` (a function or a member) applied to each element, in order.
template <class List, class F>
auto mapped(const List& list, F&& f) {
  std::vector<std::decay_t<decltype(std::invoke(f, *list.begin()))>> result;
  result.reserve(list.size());
  for (const auto& one : list) result.push_back(std::invoke(f, one));
  return result;
}

// f(0), ..., f(count - 1)
template <class Count, class F>
auto numbered(Count count, F&& f) {
  std::vector<std::decay_t<decltype(f(count))>> result;
  for (Count i = 0; i < count; ++i) result.push_back(f(i));
  return result;
}

// The elements for which `f` (a function or a member) is true, in order.
template <class List, class F>
auto filtered(const List& list, F&& f) {
  std::vector<std::decay_t<decltype(*list.begin())>> result;
  for (const auto& one : list) {
    if (std::invoke(f, one)) result.push_back(one);
  }
  return result;
}

// The first element for which `f` (a function or a member) is true; null when there is none.
template <class List, class F>
auto first_where(List& list, F&& f) -> decltype(&*list.begin()) {
  for (auto& one : list) {
    if (std::invoke(f, one)) return &one;
  }
  return nullptr;
}

template <class T>
void append(std::vector<T>& list, const std::vector<T>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

template <class Map>
auto keys_of(const Map& map) {
  return mapped(map, &Map::value_type::first);
}

// The value of the key in the map; null when the key is absent.
template <class Map>
auto find_or_null(Map& map, const typename Map::key_type& key) {
  const auto found = map.find(key);
  return found == map.end() ? nullptr : &found->second;
}

// The value of the key in the map; `otherwise` when the key is absent.
template <class Map>
typename Map::mapped_type value_or(const Map& map, const typename Map::key_type& key,
                                   const typename Map::mapped_type& otherwise) {
  const auto* found = find_or_null(map, key);
  return found ? *found : otherwise;
}

}  // namespace retrograde::ir
