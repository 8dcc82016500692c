// insert_barriers -- between what one thread of a block stores and another one reads, all wait.
//
//   gpu_thread for (x) { tile[x] = in[x] }          gpu_thread for (x) { tile[x] = in[x] }
//   gpu_thread for (x) {                        =>  gpu_barrier
//     out[x] = tile[x] + tile[x + 1]                gpu_thread for (x) { ... }
//   }
//
// Method: a block runs steps, each a nest of loops over threads, or what a single thread does, one
// after the other. A barrier stands before the first step that stores what a step since the last
// barrier reads or stores, or reads what it stores: the same bytes of shared memory, or the same
// storage elsewhere. None where each element is one thread's alone (thread_elements.h): a thread sees
// what it stored. Loops in which steps lie are walked twice: what the end of an iteration leaves
// behind may meet the beginning of the next.
// Not done: a step's own conflicts: iterations of one loop over threads touch nothing of each other.
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "ir/visit.h"
#include "lower/device/kernel.h"
#include "lower/device/thread_elements.h"

namespace retrograde::lower {

namespace {

// Since the last barrier.
struct Accesses {
  std::unordered_set<std::string> reads, writes;
  void add(const Accesses& other) {
    reads.insert(other.reads.begin(), other.reads.end());
    writes.insert(other.writes.begin(), other.writes.end());
  }
  void clear() {
    reads.clear();
    writes.clear();
  }
};

struct SharedPlace {
  Expr begin;
  int64_t bytes = -1;  // -1: not a constant
};

class BarrierInserter {
 public:
  explicit BarrierInserter(const Kernel& kernel) : kernel_(kernel) {
    walk(kernel.body, [&](const Allocate& n) {
      if (n.memory == MemoryType::Stack) return own_.insert(n.name), void();
      if (n.memory != MemoryType::GPUShared) return;
      const auto elements = as_const_int(n.elements);
      shared_[n.name] = {n.offset, elements ? *elements * n.type.bytes() * n.type.lanes() : -1};
    });
  }

  Stmt run() { return visit(kernel_.body); }

 private:
  Stmt visit(const Stmt& s) {
    if (!has_threads(s)) return step(s);
    if (const auto* loop = s.as<For>()) {
      if (is_gpu_thread(loop->runs)) return step(s);
      const std::vector<Stmt> before = waits_for(accesses_of(loop->extent));
      return with_barrier(before, in_loop(s));
    }
    if (const auto* choice = s.as<IfThenElse>()) return in_branches(*choice);
    if (const auto* let = s.as<LetStmt>()) {
      const std::vector<Stmt> before = waits_for(accesses_of(let->value));
      return with_barrier(before, make_let(let->name, let->value, visit(let->body)));
    }
    if (const auto* block = s.as<Block>()) {
      std::vector<Stmt> parts;
      for (const Stmt& part : block->stmts) parts.push_back(visit(part));
      return make_block(std::move(parts));
    }
    return map_children(s, [&](const Stmt& part) { return visit(part); });
  }

  Stmt in_loop(const Stmt& s) {
    const Accesses before = pending_;
    const auto once = [&] {
      return map_children(s, [&](const Stmt& part) { return visit(part); });
    };
    once();
    pending_.add(before);
    return once();
  }

  Stmt in_branches(const IfThenElse& choice) {
    const std::vector<Stmt> before = waits_for(accesses_of(choice.condition));
    const Accesses entry = pending_;
    const Stmt when_true = visit(choice.when_true);
    const Accesses after_true = pending_;
    pending_ = entry;
    const Stmt when_false = choice.when_false.defined() ? visit(choice.when_false) : Stmt();
    pending_.add(after_true);
    return with_barrier(before, make_if(choice.condition, when_true, when_false));
  }

  Stmt step(const Stmt& s) { return with_barrier(waits_for(accesses_of(s)), s); }

  static Stmt with_barrier(std::vector<Stmt> before, const Stmt& s) {
    before.push_back(s);
    return make_block(std::move(before));
  }

  // The barrier before what touches this; nothing where none is needed.
  std::vector<Stmt> waits_for(const Accesses& next) {
    std::vector<Stmt> barrier;
    if (any_meet(next.reads, pending_.writes) || any_meet(next.writes, pending_.writes) ||
        any_meet(next.writes, pending_.reads)) {
      barrier.push_back(make_evaluate(call_op(Op::gpu_barrier, Int(32), {})));
      pending_.clear();
    }
    pending_.add(next);
    return barrier;
  }

  using Names = std::unordered_set<std::string>;
  bool any_meet(const Names& a, const Names& b) {
    for (const std::string& one : a) {
      for (const std::string& other : b) {
        if (may_meet(one, other)) return true;
      }
    }
    return false;
  }

  bool may_meet(const std::string& a, const std::string& b) {
    if (a == b) return !is_one_threads(a);
    const auto first = shared_.find(a), second = shared_.find(b);
    if (first == shared_.end() || second == shared_.end()) return false;
    const auto begin = as_const_int(first->second.begin),
               other = as_const_int(second->second.begin);
    if (!begin || !other || first->second.bytes < 0 || second->second.bytes < 0) return true;
    return *begin < *other + second->second.bytes && *other < *begin + first->second.bytes;
  }

  bool is_one_threads(const std::string& name) {
    const auto [known, is_new] = one_threads_.try_emplace(name, false);
    if (is_new) known->second = find_thread_elements(kernel_, name).has_value();
    return known->second;
  }

  template <class Tree>
  Accesses accesses_of(const Tree& tree) const {
    Accesses found;
    const auto note = [&](Names& names, const std::string& name) {
      if (!own_.count(name)) names.insert(name);
    };
    if constexpr (std::is_same_v<Tree, Stmt>) {
      walk(
          tree, [&](const Load& n) { note(found.reads, n.name); },
          [&](const Store& n) { note(found.writes, n.name); });
    } else {
      walk(tree, [&](const Load& n) { note(found.reads, n.name); });
    }
    return found;
  }

  const Kernel& kernel_;
  Names own_;
  std::unordered_map<std::string, SharedPlace> shared_;
  std::unordered_map<std::string, bool> one_threads_;
  Accesses pending_;
};

}  // namespace

void insert_barriers(Kernel& kernel) { kernel.body = BarrierInserter(kernel).run(); }

}  // namespace retrograde::lower
