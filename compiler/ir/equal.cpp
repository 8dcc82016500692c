// Structural order, equality and hash. The hash is kept in the node, so unequal trees are told
// apart at once and equal ones are compared once per pair of nodes.
#include "ir/equal.h"

#include <bit>
#include <cstring>
#include <string_view>
#include <unordered_set>

#include "ir/visit.h"

namespace retrograde::ir {

namespace {

template <class T>
int order(const T& a, const T& b) {
  return a < b ? -1 : b < a ? 1 : 0;
}

// Compares two trees, remembering the pairs of nodes that were equal: linear in the product of
// sharing.
class Comparer {
 public:
  int compare(const Expr& a, const Expr& b) {
    if (a.same_as(b)) return 0;
    if (!a.defined() || !b.defined()) return a.defined() ? 1 : -1;
    if (const int result = order(a->kind, b->kind)) return result;
    if (const int result = order(a->type, b->type)) return result;
    if (equal_pairs_.count({a.get(), b.get()})) return 0;
    const int result = compare_nodes(a, b);
    if (result == 0) equal_pairs_.insert({a.get(), b.get()});
    return result;
  }
  int compare(const Stmt& a, const Stmt& b);

  template <class T>
  int compare_all(const std::vector<T>& a, const std::vector<T>& b) {
    if (const int result = order(a.size(), b.size())) return result;
    for (size_t i = 0; i < a.size(); ++i) {
      if (const int result = compare(a[i], b[i])) return result;
    }
    return 0;
  }
  int compare(const Range& a, const Range& b) {
    const int result = compare(a.min, b.min);
    return result ? result : compare(a.extent, b.extent);
  }
  int compare(const Type& a, const Type& b) { return order(a, b); }

 private:
  // The first non-zero of several comparisons, evaluated lazily.
  template <class... Fs>
  static int first(Fs... fs) {
    int result = 0;
    ((result = fs()) || ...);
    return result;
  }
  int compare_nodes(const Expr& a, const Expr& b);
  int compare_nodes(const Stmt& a, const Stmt& b);

  struct PairHash {
    size_t operator()(const std::pair<const Node*, const Node*>& p) const {
      return std::hash<const Node*>()(p.first) * 31 + std::hash<const Node*>()(p.second);
    }
  };
  std::unordered_set<std::pair<const Node*, const Node*>, PairHash> equal_pairs_;
};

int Comparer::compare_nodes(const Expr& a, const Expr& b) {
  // Other kinds than `a`'s were ruled out before.
  const auto same_kind = [&]<class N>(const N&) -> const N& {
    return *static_cast<const N*>(b.get());
  };
  return match(
      a, [&](const IntImm& n) { return order(n.value, same_kind(n).value); },
      [&](const UIntImm& n) { return order(n.value, same_kind(n).value); },
      [&](const FloatImm& n) {
        return order(std::bit_cast<int64_t>(n.value), std::bit_cast<int64_t>(same_kind(n).value));
      },
      [&](const StringImm& n) { return order(n.value, same_kind(n).value); },
      [&](const Variable& n) { return order(n.name, same_kind(n).name); },
      [&](const Cast& n) { return compare(n.value, same_kind(n).value); },
      [&](const Reinterpret& n) { return compare(n.value, same_kind(n).value); },
      [&](const Binary& n) {
        const auto& m = static_cast<const Binary&>(*b.get());
        const int result = compare(n.a, m.a);
        return result ? result : compare(n.b, m.b);
      },
      [&](const Not& n) { return compare(n.a, same_kind(n).a); },
      [&](const Select& n) {
        const Select& m = same_kind(n);
        return first([&] { return compare(n.condition, m.condition); },
                     [&] { return compare(n.when_true, m.when_true); },
                     [&] { return compare(n.when_false, m.when_false); });
      },
      [&](const Load& n) {
        const Load& m = same_kind(n);
        return first([&] { return order(n.name, m.name); },
                     [&] { return compare(n.index, m.index); },
                     [&] { return compare(n.predicate, m.predicate); });
      },
      [&](const Ramp& n) {
        const Ramp& m = same_kind(n);
        return first([&] { return order(n.lanes, m.lanes); },
                     [&] { return compare(n.base, m.base); },
                     [&] { return compare(n.stride, m.stride); });
      },
      [&](const Broadcast& n) {
        const Broadcast& m = same_kind(n);
        return first([&] { return order(n.lanes, m.lanes); },
                     [&] { return compare(n.value, m.value); });
      },
      [&](const Call& n) {
        const Call& m = same_kind(n);
        return first([&] { return order(n.call_type, m.call_type); },
                     [&] { return order(n.op, m.op); }, [&] { return order(n.name, m.name); },
                     [&] { return order(n.component, m.component); },
                     [&] { return compare_all(n.args, m.args); });
      },
      [&](const Let& n) {
        const Let& m = same_kind(n);
        return first([&] { return order(n.name, m.name); },
                     [&] { return compare(n.value, m.value); },
                     [&] { return compare(n.body, m.body); });
      },
      [&](const Shuffle& n) {
        const Shuffle& m = same_kind(n);
        return first([&] { return order(n.indices, m.indices); },
                     [&] { return compare_all(n.vectors, m.vectors); });
      },
      [&](const VectorReduce& n) {
        const VectorReduce& m = same_kind(n);
        return first([&] { return order(n.op, m.op); }, [&] { return compare(n.value, m.value); });
      },
      [](const ExprNode&) { return 0; });
}

int Comparer::compare(const Stmt& a, const Stmt& b) {
  if (a.same_as(b)) return 0;
  if (!a.defined() || !b.defined()) return a.defined() ? 1 : -1;
  const int result = order(a->kind, b->kind);
  return result ? result : compare_nodes(a, b);
}

int Comparer::compare_nodes(const Stmt& a, const Stmt& b) {
  const auto same_kind = [&]<class N>(const N&) -> const N& {
    return *static_cast<const N*>(b.get());
  };
  return match(
      a,
      [&](const LetStmt& n) {
        const LetStmt& m = same_kind(n);
        return first([&] { return order(n.name, m.name); },
                     [&] { return compare(n.value, m.value); },
                     [&] { return compare(n.body, m.body); });
      },
      [&](const Assert& n) {
        const Assert& m = same_kind(n);
        return first([&] { return compare(n.condition, m.condition); },
                     [&] { return compare(n.error, m.error); });
      },
      [&](const ProducerConsumer& n) {
        const ProducerConsumer& m = same_kind(n);
        return first([&] { return order(n.name, m.name); },
                     [&] { return order(n.produces, m.produces); },
                     [&] { return compare(n.body, m.body); });
      },
      [&](const For& n) {
        const For& m = same_kind(n);
        return first(
            [&] { return order(n.name, m.name); }, [&] { return order(n.runs, m.runs); },
            [&] { return order(n.partition, m.partition); }, [&] { return compare(n.min, m.min); },
            [&] { return compare(n.extent, m.extent); }, [&] { return compare(n.body, m.body); });
      },
      [&](const Store& n) {
        const Store& m = same_kind(n);
        return first([&] { return order(n.name, m.name); },
                     [&] { return compare(n.value, m.value); },
                     [&] { return compare(n.index, m.index); },
                     [&] { return compare(n.predicate, m.predicate); });
      },
      [&](const Provide& n) {
        const Provide& m = same_kind(n);
        return first([&] { return order(n.name, m.name); },
                     [&] { return compare_all(n.values, m.values); },
                     [&] { return compare_all(n.args, m.args); },
                     [&] { return compare(n.predicate, m.predicate); });
      },
      [&](const Realize& n) {
        const Realize& m = same_kind(n);
        return first([&] { return order(n.name, m.name); },
                     [&] { return compare_all(n.types, m.types); },
                     [&] { return order(n.memory, m.memory); },
                     [&] { return compare_all(n.bounds, m.bounds); },
                     [&] { return compare(n.body, m.body); });
      },
      [&](const Allocate& n) {
        const Allocate& m = same_kind(n);
        return first([&] { return order(n.name, m.name); }, [&] { return order(n.type, m.type); },
                     [&] { return order(n.memory, m.memory); },
                     [&] { return compare(n.elements, m.elements); },
                     [&] { return compare(n.body, m.body); });
      },
      [&](const Free& n) { return order(n.name, same_kind(n).name); },
      [&](const Block& n) { return compare_all(n.stmts, same_kind(n).stmts); },
      [&](const IfThenElse& n) {
        const IfThenElse& m = same_kind(n);
        return first([&] { return compare(n.condition, m.condition); },
                     [&] { return compare(n.when_true, m.when_true); },
                     [&] { return compare(n.when_false, m.when_false); });
      },
      [&](const Evaluate& n) { return compare(n.value, same_kind(n).value); },
      [&](const Atomic& n) {
        const Atomic& m = same_kind(n);
        return first([&] { return order(n.name, m.name); },
                     [&] { return compare(n.body, m.body); });
      },
      [&](const Fork& n) {
        const Fork& m = same_kind(n);
        return first([&] { return compare(n.first, m.first); },
                     [&] { return compare(n.rest, m.rest); });
      },
      [&](const Prefetch& n) {
        const Prefetch& m = same_kind(n);
        return first([&] { return order(n.name, m.name); }, [&] { return order(n.type, m.type); },
                     [&] { return compare_all(n.bounds, m.bounds); });
      },
      [](const StmtNode&) { return 0; });
}

// ---- hash ----

uint64_t mix(uint64_t seed, uint64_t value) {
  seed ^= value + 0x9e3779b97f4a7c15ull + (seed << 6) + (seed >> 2);
  seed ^= seed >> 32;
  seed *= 0xd6e8feb86659fd93ull;
  return seed ^ (seed >> 32);
}

uint64_t text_hash(const std::string& s) { return std::hash<std::string_view>()(s); }

// What a node says beyond its kind, type and children.
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

}  // namespace retrograde::ir
