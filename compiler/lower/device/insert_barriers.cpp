// insert_barriers -- make all threads of a block wait between a store of one thread and an access of another.
//
//   gpu_thread for (x) { tile[x] = in[x] }          gpu_thread for (x) { tile[x] = in[x] }
//   gpu_thread for (x) {                        =>  gpu_barrier
//     out[x] = tile[x] + tile[x + 1]                gpu_thread for (x) { ... }
//   }
//
// Method: a block runs steps one after the other; a step is a nest of loops over threads, or code for a single
// thread. A barrier is inserted before the first step that conflicts with a step since the last barrier: it stores
// what that step accesses, or reads what it stores, in the same storage or the same bytes of shared memory. The
// threads that may conflict determine the kind of barrier:
// - none if each element belongs to one thread (thread_elements.h), which sees its own stores, or if the steps
//   access disjoint elements (step_accesses.h);
// - a warp barrier if each element belongs to one warp, or the block has a single warp;
// - otherwise a block barrier.
//
// Accesses of one loop iteration may conflict with the next. The loop body is walked repeatedly until an iteration adds
// no new accesses. They are expressed one iteration earlier if a barrier surely separates iterations, otherwise
// as those of any iteration.
// Not done: conflicts within a step. Iterations of a loop over threads are independent.
#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "ir/build.h"
#include "ir/equal.h"
#include "lower/device/kernel.h"
#include "lower/device/step_accesses.h"
#include "lower/device/thread_elements.h"

namespace retrograde::lower {

namespace {

enum class Wait : uint8_t { None, Warp, Block };

struct SharedPlace {
  Expr begin;
  int64_t bytes = -1;  // -1: not a constant
};

// The storage of a kernel that its threads store to, and who shares it.
class SharedStorage {
 public:
  explicit SharedStorage(const Kernel& kernel) : kernel_(kernel) {
    std::unordered_set<std::string> own;
    walk(
        kernel.body, [&](const Store& n) { stored_.insert(n.name); },
        [&](const Allocate& n) {
          if (n.memory == MemoryType::Stack) own.insert(n.name);
          if (n.memory != MemoryType::GPUShared) return;
          const auto elements = as_const_int(n.elements);
          places_[n.name] = {n.offset, elements ? *elements * n.type.bytes() * n.type.lanes() : -1};
        });
    for (const std::string& name : own) stored_.erase(name);
  }

  // Whether accesses of the storage can conflict: not if it is never stored to or is private to a thread.
  bool matters(const std::string& name) const { return stored_.count(name) > 0; }

  // The barrier needed between an access of `b` by one thread and an access of `a` by another.
  Wait wait_between(const std::string& a, const std::string& b) {
    if (a == b) return users_of(a);
    if (!share_bytes(a, b)) return Wait::None;
    return is_one_warp() ? Wait::Warp : Wait::Block;
  }

 private:
  bool is_one_warp() const {
    return kernel_.threads[0] * kernel_.threads[1] * kernel_.threads[2] <= warp_threads;
  }

  Wait users_of(const std::string& name) {
    const auto [known, is_new] = users_.try_emplace(name, Wait::Block);
    if (!is_new) return known->second;
    if (find_thread_elements(kernel_, name))
      known->second = Wait::None;
    else if (is_one_warp() || belongs_to_one_warp(kernel_, name))
      known->second = Wait::Warp;
    return known->second;
  }

  bool share_bytes(const std::string& a, const std::string& b) const {
    const auto first = places_.find(a), second = places_.find(b);
    if (first == places_.end() || second == places_.end()) return false;
    const auto begin = as_const_int(first->second.begin),
               other = as_const_int(second->second.begin);
    if (!begin || !other || first->second.bytes < 0 || second->second.bytes < 0) return true;
    return *begin < *other + second->second.bytes && *other < *begin + first->second.bytes;
  }

  const Kernel& kernel_;
  std::unordered_set<std::string> stored_;
  std::unordered_map<std::string, SharedPlace> places_;
  std::unordered_map<std::string, Wait> users_;
};

// An access since the last barrier of the block.
struct Pending {
  Access access;
  bool is_before_warp_barrier = false;

  bool is_same(const Pending& other) const {
    const auto same_end = [](const Expr& a, const Expr& b) {
      return a.defined() == b.defined() && (!a.defined() || equal(a, b));
    };
    return access.name == other.access.name && access.stores == other.access.stores &&
           same_end(access.elements.min, other.access.elements.min) &&
           same_end(access.elements.max, other.access.elements.max);
  }
};

// Returns whether the list changed.
bool add(std::vector<Pending>& list, const Pending& one) {
  const auto found =
      std::ranges::find_if(list, [&](const Pending& other) { return other.is_same(one); });
  if (found == list.end()) return list.push_back(one), true;
  const bool says_more = found->is_before_warp_barrier && !one.is_before_warp_barrier;
  found->is_before_warp_barrier &= one.is_before_warp_barrier;
  return says_more;
}
bool add(std::vector<Pending>& list, const std::vector<Pending>& more) {
  bool says_more = false;
  for (const Pending& one : more) says_more |= add(list, one);
  return says_more;
}

class BarrierInserter {
 public:
  explicit BarrierInserter(const Kernel& kernel) : kernel_(kernel), storage_(kernel) {}

  Stmt run() { return visit(kernel_.body); }

 private:
  // The state of the block at a point of the program.
  struct State {
    std::vector<Pending> pending;
    Wait passed =
        Wait::None;  // the strongest barrier that surely ran in this iteration of the loop
  };

  Stmt visit(const Stmt& s) {
    if (!has_threads(s)) return step(s);
    if (const auto* loop = s.as<For>()) {
      if (is_gpu_thread(loop->runs)) return step(s);
      const std::vector<Stmt> before =
          waits_for(make_block({make_evaluate(loop->min), make_evaluate(loop->extent)}));
      return with_barrier(before, in_loop(s, *loop));
    }
    if (const auto* choice = s.as<IfThenElse>()) return in_branches(*choice);
    if (const auto* let = s.as<LetStmt>()) {
      const std::vector<Stmt> before = waits_for(make_evaluate(let->value));
      around_.define(*let);
      return with_barrier(before, make_let(let->name, let->value, visit(let->body)));
    }
    if (const auto* block = s.as<Block>()) {
      std::vector<Stmt> parts;
      for (const Stmt& part : block->stmts) parts.push_back(visit(part));
      return make_block(std::move(parts));
    }
    return inside(s);
  }

  Stmt inside(const Stmt& s) {
    return map_children(s, [&](const Stmt& part) { return visit(part); });
  }

  Stmt in_loop(const Stmt& s, const For& loop) {
    const State before = state_;
    const bool runs = around_.can_prove_runs(loop);
    std::vector<Pending> from_earlier;
    Stmt result;
    around_.enter(loop);
    do {
      state_ = {before.pending, Wait::None};
      add(state_.pending, from_earlier);
      result = inside(s);
    } while (add(from_earlier, left_for_next(loop)));
    around_.leave(loop);
    std::vector<Pending> after;
    for (const Pending& one : state_.pending)
      add(after, Pending{around_.in_any_iteration(one.access, loop), one.is_before_warp_barrier});
    state_.pending = std::move(after);
    if (!runs) {
      add(state_.pending, before.pending);
      state_.passed = Wait::None;
    }
    state_.passed = std::max(state_.passed, before.passed);
    return result;
  }

  // The accesses that the next iteration sees. Without a barrier in between they may be of any earlier iteration.
  std::vector<Pending> left_for_next(const For& loop) const {
    std::vector<Pending> left;
    for (const Pending& one : state_.pending) {
      const Wait since = one.is_before_warp_barrier ? Wait::Block : Wait::Warp;
      const Access access = state_.passed >= since
                                ? StepSurroundings::one_iteration_earlier(one.access, loop)
                                : around_.in_any_iteration(one.access, loop);
      add(left, Pending{access, one.is_before_warp_barrier});
    }
    return left;
  }

  Stmt in_branches(const IfThenElse& choice) {
    const std::vector<Stmt> before = waits_for(make_evaluate(choice.condition));
    const State entry = state_;
    const Stmt when_true = visit(choice.when_true);
    const State after_true = state_;
    state_ = entry;
    const Stmt when_false = choice.when_false.defined() ? visit(choice.when_false) : Stmt();
    add(state_.pending, after_true.pending);
    state_.passed = std::min(state_.passed, after_true.passed);
    return with_barrier(before, make_if(choice.condition, when_true, when_false));
  }

  Stmt step(const Stmt& s) { return with_barrier(waits_for(s), s); }

  static Stmt with_barrier(std::vector<Stmt> before, const Stmt& s) {
    before.push_back(s);
    return make_block(std::move(before));
  }

  // The barrier needed before `next`; empty if none is needed. Records the accesses of `next`.
  std::vector<Stmt> waits_for(const Stmt& next) {
    std::vector<Access> accesses = around_.accesses_of(next);
    std::erase_if(accesses, [&](const Access& one) { return !storage_.matters(one.name); });
    Wait wait = Wait::None;
    for (const Access& access : accesses) {
      for (const Pending& before : state_.pending)
        wait = std::max(wait, wait_between(before, access));
    }
    std::vector<Stmt> barrier;
    if (wait != Wait::None) {
      const Op op = wait == Wait::Block ? Op::gpu_barrier : Op::gpu_warp_barrier;
      barrier.push_back(make_evaluate(call_op(op, Int(32), {})));
      if (wait == Wait::Block) state_.pending.clear();
      for (Pending& before : state_.pending) before.is_before_warp_barrier = true;
      state_.passed = std::max(state_.passed, wait);
    }
    for (Access& access : accesses) add(state_.pending, Pending{std::move(access), false});
    return barrier;
  }

  Wait wait_between(const Pending& before, const Access& next) {
    if (!before.access.stores && !next.stores) return Wait::None;
    const Wait wait = storage_.wait_between(before.access.name, next.name);
    if (wait == Wait::None || (wait == Wait::Warp && before.is_before_warp_barrier))
      return Wait::None;
    const bool are_apart =
        before.access.name == next.name && around_.can_prove_apart(before.access, next);
    return are_apart ? Wait::None : wait;
  }

  const Kernel& kernel_;
  SharedStorage storage_;
  StepSurroundings around_;
  State state_;
};

}  // namespace

void insert_barriers(Kernel& kernel) { kernel.body = BarrierInserter(kernel).run(); }

}  // namespace retrograde::lower
