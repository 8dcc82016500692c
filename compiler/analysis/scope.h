// Names in scope with their values; the innermost binding of a name wins.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

namespace retrograde::analysis {

template <class T>
class Scope {
 public:
  explicit Scope(const Scope* outer = nullptr) : outer_(outer) {}
  void push(const std::string& name, T value) { bindings_[name].push_back(std::move(value)); }
  void pop(const std::string& name) {
    auto it = bindings_.find(name);
    it->second.pop_back();
    if (it->second.empty()) bindings_.erase(it);
  }
  const T* find(const std::string& name) const {
    auto it = bindings_.find(name);
    if (it != bindings_.end()) return &it->second.back();
    return outer_ ? outer_->find(name) : nullptr;
  }
  bool contains(const std::string& name) const { return find(name) != nullptr; }

 private:
  const Scope* outer_;
  std::unordered_map<std::string, std::vector<T>> bindings_;
};

}  // namespace retrograde::analysis
