// Structural order, equality and hash. The hash is cached in the node, so unequal trees differ at
// once, and equal ones are compared once per pair of nodes.
#include "ir/equal.h"

#include <bit>
#include <string_view>
#include <unordered_set>

#include "ir/build.h"
#include "ir/shifted_renaming.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

template <class T>
int order(const T& a, const T& b) {
  return a < b ? -1 : b < a ? 1 : 0;
}

// Pairs of names that stand for each other.
class NamePairs {
 public:
  explicit NamePairs(const Renaming& known) {
    for (const auto& [a, b] : known) match(a, b);
  }
  // Whether they are a pair; names that have no partner yet become one.
  bool match(const std::string& a, const std::string& b) {
    const auto [forward, is_new] = forward_.try_emplace(a, b);
    if (!is_new) return forward->second == b;
    return backward_.try_emplace(b, a).second;
  }
  Renaming take() { return std::move(forward_); }

 private:
  Renaming forward_, backward_;
};

using Shifts = std::unordered_map<std::string, Shift>;

// An integer expression as a part and a constant; the part of a constant is undefined.
std::pair<Expr, int64_t> split_constant(const Expr& e) {
  if (const auto* constant = e.as<IntImm>()) return {Expr(), constant->value};
  const auto* sum = e.as<Binary>();
  const bool subtracts = sum && sum->kind == Kind::Sub;
  const auto* constant =
      sum && (sum->kind == Kind::Add || subtracts) ? sum->b.as<IntImm>() : nullptr;
  if (!constant) return {e, 0};
  const auto [part, more] = split_constant(sum->a);
  return {part, subtracts ? more - constant->value : more + constant->value};
}

// Compares two trees and remembers the pairs of expressions found equal, so the cost is linear in
// the number of distinct pairs. With `names`, only decides whether the trees are equal up to names.
class Comparer {
 public:
  explicit Comparer(NamePairs* names = nullptr, Shifts* shifts = nullptr)
      : names_(names), shifts_(shifts) {}

  int compare(const Expr& a, const Expr& b) {
    if (!names_ && a.same_as(b)) return 0;
    if (!a.defined() || !b.defined()) return a.defined() - b.defined();
    if (const int result = order(a->kind, b->kind)) return result;
    if (const int result = order(a->type, b->type)) return result;
    if (equal_pairs_.count({a.get(), b.get()})) return 0;
    const int result = compare_nodes(a, b);
    if (result == 0) equal_pairs_.insert({a.get(), b.get()});
    return result;
  }
  int compare(const Stmt& a, const Stmt& b) {
    if (!names_ && a.same_as(b)) return 0;
    if (!a.defined() || !b.defined()) return a.defined() - b.defined();
    if (names_ && a.kind() == Kind::Launch) return 1;  // its kernel has its name
    const int result = order(a->kind, b->kind);
    return result ? result : compare_nodes(a, b);
  }

 private:
  // For two nodes of one kind.
  template <class Handle>
  int compare_nodes(const Handle& a, const Handle& b) {
    return match(a, [&]<class N>(const N& n) {
      if constexpr (std::is_same_v<N, Load> || std::is_same_v<N, Store>) {
        if (shifts_) return compare_accesses(n, *static_cast<const N*>(b.get()));
      }
      if constexpr (requires { n.fields(); }) {
        return std::apply(
            [&](const auto&... of_a) {
              return std::apply(
                  [&](const auto&... of_b) {
                    int result = 0;
                    ((result = compare_field<N>(of_a, of_b)) || ...);
                    return result;
                  },
                  static_cast<const N*>(b.get())->fields());
            },
            n.fields());
      } else {
        return 0;
      }
    });
  }

  static Type element_of(const Load& n) { return n.type.element_of(); }
  static Type element_of(const Store& n) { return n.value.type().element_of(); }
  int compare_values(const Load&, const Load&) { return 0; }
  int compare_values(const Store& a, const Store& b) { return compare(a.value, b.value); }

  template <class N>
  int compare_accesses(const N& a, const N& b) {
    if (const int result = compare(a.name, b.name)) return result;
    if (const int result = compare_values(a, b)) return result;
    if (const int result = compare(a.predicate, b.predicate)) return result;
    int64_t distance = 0;
    if (const int result = compare_indices(a.index, b.index, distance)) return result;
    const auto known = shifts_->try_emplace(a.name, Shift{distance, element_of(a)}).first;
    return order(known->second.elements, distance);
  }
  // 0 if b is a + distance.
  int compare_indices(const Expr& a, const Expr& b, int64_t& distance) {
    if (a.type() != b.type()) return 1;
    const auto *ramp = a.as<Ramp>(), *other = b.as<Ramp>();
    if (ramp && other && ramp->lanes == other->lanes) {
      const int result = compare(ramp->stride, other->stride);
      return result ? result : compare_indices(ramp->base, other->base, distance);
    }
    const auto *all = a.as<Broadcast>(), *other_all = b.as<Broadcast>();
    if (all && other_all && all->lanes == other_all->lanes)
      return compare_indices(all->value, other_all->value, distance);
    const auto [part, constant] = split_constant(a);
    const auto [other_part, other_constant] = split_constant(b);
    distance = other_constant - constant;
    return compare(part, other_part);
  }

  // Texts, and names of operators and functions, are no names that a renaming changes.
  template <class N, class T>
  int compare_field(const T& a, const T& b) {
    if constexpr (std::is_same_v<N, StringImm> || std::is_same_v<N, Call>) {
      if constexpr (std::is_same_v<T, std::string>) return order(a, b);
    }
    return compare(a, b);
  }
  int compare(const std::string& a, const std::string& b) {
    return names_ ? !names_->match(a, b) : order(a, b);
  }
  template <class T>
  int compare(const T& a, const T& b) {
    return order(a, b);
  }
  int compare(double a, double b) {
    return order(std::bit_cast<int64_t>(a), std::bit_cast<int64_t>(b));
  }
  int compare(const Range& a, const Range& b) {
    const int result = compare(a.min, b.min);
    return result ? result : compare(a.extent, b.extent);
  }
  int compare(const StorageLayout& a, const StorageLayout& b) {
    int result = 0;
    (void)((result = compare(a.order, b.order)) || (result = compare(a.folds, b.folds)) ||
           (result = compare(a.place, b.place)) || (result = compare(a.first, b.first)) ||
           (result = compare(a.lead, b.lead)));
    return result;
  }
  template <class T>
  int compare(const std::vector<T>& a, const std::vector<T>& b) {
    if (const int result = order(a.size(), b.size())) return result;
    for (size_t i = 0; i < a.size(); ++i) {
      if (const int result = compare(a[i], b[i])) return result;
    }
    return 0;
  }

  struct PairHash {
    size_t operator()(const std::pair<const Node*, const Node*>& p) const {
      return std::hash<const Node*>()(p.first) * 31 + std::hash<const Node*>()(p.second);
    }
  };
  std::unordered_set<std::pair<const Node*, const Node*>, PairHash> equal_pairs_;
  NamePairs* names_;
  Shifts* shifts_;  // null: indices are equal
};

// ---- hash ----

uint64_t mix(uint64_t seed, uint64_t value) {
  seed ^= value + 0x9e3779b97f4a7c15ull + (seed << 6) + (seed >> 2);
  seed ^= seed >> 32;
  seed *= 0xd6e8feb86659fd93ull;
  return seed ^ (seed >> 32);
}

uint64_t text_hash(const std::string& s) { return std::hash<std::string_view>()(s); }

// The data of a node besides kind, type and children.
uint64_t payload(const Expr& e) {
  return match(
      e, [](const IntImm& n) { return static_cast<uint64_t>(n.value); },
      [](const UIntImm& n) { return n.value; },
      [](const FloatImm& n) { return std::bit_cast<uint64_t>(n.value); },
      [](const StringImm& n) { return text_hash(n.value); },
      [](const Variable& n) { return text_hash(n.name); },
      [](const Load& n) { return mix(text_hash(n.name), n.predicate.defined()); },
      [](const Ramp& n) { return static_cast<uint64_t>(n.lanes); },
      [](const Broadcast& n) { return static_cast<uint64_t>(n.lanes); },
      [](const Call& n) {
        uint64_t h = mix(static_cast<uint64_t>(n.call_type), static_cast<uint64_t>(n.op));
        if (n.op == Op::none) h = mix(h, text_hash(n.name));
        return mix(h, static_cast<uint64_t>(n.component));
      },
      [](const Let& n) { return text_hash(n.name); },
      [](const Shuffle& n) {
        uint64_t h = n.indices.size();
        for (int index : n.indices) h = mix(h, static_cast<uint64_t>(index));
        return h;
      },
      [](const VectorReduce& n) { return static_cast<uint64_t>(n.op); },
      [](const ExprNode&) { return uint64_t{0}; });
}

}  // namespace

size_t hash(const Expr& e) {
  if (!e.defined()) return 0;
  if (const uint64_t known = e->hash.load(std::memory_order_relaxed)) return known;
  uint64_t h = mix(static_cast<uint64_t>(e->kind) + 1, e->type.key());
  h = mix(h, payload(e));
  for_each_child(e, [&](const Expr& child) { h = mix(h, hash(child)); });
  if (h == 0) h = 1;
  e->hash.store(h, std::memory_order_relaxed);
  return h;
}

bool equal(const Expr& a, const Expr& b) {
  if (a.same_as(b)) return true;
  if (!a.defined() || !b.defined() || a->kind != b->kind || hash(a) != hash(b)) return false;
  return Comparer().compare(a, b) == 0;
}

bool equal(const Stmt& a, const Stmt& b) { return Comparer().compare(a, b) == 0; }
int compare(const Expr& a, const Expr& b) { return a.same_as(b) ? 0 : Comparer().compare(a, b); }

std::optional<Renaming> renaming(const Stmt& a, const Stmt& b, const Renaming& known) {
  NamePairs names(known);
  if (Comparer(&names).compare(a, b) != 0) return std::nullopt;
  return names.take();
}

std::optional<ShiftedRenaming> shifted_renaming(const Stmt& a, const Stmt& b,
                                                const Renaming& known) {
  NamePairs names(known);
  ShiftedRenaming result;
  if (Comparer(&names, &result.shifts).compare(a, b) != 0) return std::nullopt;
  result.names = names.take();
  std::erase_if(result.shifts, [](const auto& one) { return one.second.elements == 0; });
  return result;
}

Expr shifted_index(const Expr& index, int64_t elements) {
  if (const auto* ramp = index.as<Ramp>())
    return make_ramp(shifted_index(ramp->base, elements), ramp->stride, ramp->lanes);
  if (const auto* all = index.as<Broadcast>())
    return make_broadcast(shifted_index(all->value, elements), all->lanes);
  return binary(Kind::Add, index, make_const(index.type(), elements));
}

}  // namespace retrograde::ir
