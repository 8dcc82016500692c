// node_set.h -- the set of nodes that a walk has visited. Most walks are short, so the first few
// nodes lie in the set itself and need no allocation; no node is allocated singly.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace retrograde::ir {

struct Node;

// A hash table with open addressing, at most half full.
class NodeSet {
 public:
  // Inserts the node; returns whether it is new.
  bool insert(const Node* node) {
    if (2 * (count_ + 1) > size_) grow();
    if (!put(node)) return false;
    count_++;
    return true;
  }

 private:
  static constexpr size_t first_size = 32;
  std::array<const Node*, first_size> first_{};
  std::vector<const Node*> more_;  // replaces `first_` once that is too small
  size_t count_ = 0, size_ = first_size;

  const Node** slots() { return more_.empty() ? first_.data() : more_.data(); }

  // Nodes are aligned to 16 bytes; the multiplication spreads the remaining address bits upwards.
  static size_t hash(const Node* node) {
    return (reinterpret_cast<uintptr_t>(node) >> 4) * 0x9e3779b97f4a7c15u >> 32;
  }

  bool put(const Node* node) {
    const Node** const table = slots();
    size_t at = hash(node) & (size_ - 1);
    for (; table[at]; at = (at + 1) & (size_ - 1)) {
      if (table[at] == node) return false;
    }
    table[at] = node;
    return true;
  }

  void grow() {
    std::vector<const Node*> larger(4 * size_);
    const std::vector<const Node*> old(slots(), slots() + size_);
    more_.swap(larger);
    size_ *= 4;
    for (const Node* node : old) {
      if (node) put(node);
    }
  }
};

}  // namespace retrograde::ir
