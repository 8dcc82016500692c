// choose_threads -- choose the number of threads of a kernel's blocks, and the memory of its storage.
//
// A kernel has one number of threads per dimension, shared by its stages: the largest one that a stage is known to
// use. Stages with smaller extents leave threads idle; in stages with larger ones each thread runs several
// iterations (map_threads). If no extent is known, the dimension gets a default.
//
// Storage inside a loop over threads is private to the thread; storage in a block, outside of such loops, is shared.
#include <algorithm>
#include <optional>

#include "diagnostics/error.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/device/kernel.h"
#include "lower/expand_lets_in_scope.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "simplify/facts.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int most_threads = 1024;
constexpr size_t most_dimensions = 3;

class ThreadChooser {
 public:
  explicit ThreadChooser(Kernel& kernel) : kernel_(kernel) {}

  void choose() {
    visit(kernel_.body);
    const auto used = static_cast<size_t>(std::max(depth_, 1));
    for (size_t d = 0; d < used; ++d) {
      const int unknown = used == 1 ? 4 * warp_threads : d == 0 ? warp_threads : 4;
      kernel_.threads[d] = most_[d] > 0 ? most_[d] : wants_some_[d] ? unknown : 1;
    }
    // Stages of different shapes share a block: halve the largest dimension until the block is small enough.
    while (total() > most_threads) {
      int& largest = *std::ranges::max_element(kernel_.threads);
      largest = (largest + 1) / 2;
    }
  }

 private:
  int total() const { return kernel_.threads[0] * kernel_.threads[1] * kernel_.threads[2]; }

  void visit(const Stmt& s) {
    if (!s.defined()) return;
    if (const auto* let = s.as<LetStmt>()) lets_[let->name] = let->value;
    const auto* loop = s.as<For>();
    if (loop && is_gpu_thread(loop->runs)) return visit_threads(*loop, 1);
    for_each_child(
        s, [](const Expr&) {}, [&](const Stmt& part) { visit(part); });
  }

  // `around`: the product of the known extents of the loops over threads around this one.
  void visit_threads(const For& loop, int64_t around) {
    const auto dimension = static_cast<size_t>(thread_depth(loop.body));
    depth_ = std::max(depth_, static_cast<int>(dimension) + 1);
    if (dimension >= most_dimensions) {
      refuse(loop, "a block has at most three dimensions",
             text("there are ", dimension + 1, " loops over threads in each other"),
             "Fuse two of them, or keep one serial");
    }
    const Expr extent = simplify(expand_lets_in_scope(loop.extent, lets_));
    if (any_node(extent, [](const Load&) { return true; })) {
      refuse(loop, "the number of threads does not depend on data",
             text("the loop runs ", extent, " times"),
             "Split the loop by a constant, and run the inner loop over threads");
    }
    const std::optional<int64_t> most = largest(extent);
    wants_some_[dimension] = true;
    if (most) around *= *most;
    if (around > most_threads || (most && *most > most_threads)) {
      refuse(loop, text("a block has at most ", most_threads, " threads"),
             text("the loops over threads down to it run ", around, " times"),
             "Split the loops by smaller factors");
    }
    check_lane(loop, dimension, most);
    if (most) most_[dimension] = std::max(most_[dimension], static_cast<int>(*most));
    visit_inside(loop.body, around);
  }

  void visit_inside(const Stmt& s, int64_t around) {
    if (!s.defined()) return;
    if (const auto* let = s.as<LetStmt>()) lets_[let->name] = let->value;
    const auto* loop = s.as<For>();
    if (loop && is_gpu_thread(loop->runs)) return visit_threads(*loop, around);
    for_each_child(
        s, [](const Expr&) {}, [&](const Stmt& part) { visit_inside(part, around); });
  }

  void check_lane(const For& loop, size_t dimension, const std::optional<int64_t>& most) const {
    if (loop.runs != ForType::GpuLane) return;
    if (dimension != 0) {
      refuse(loop, "lanes are the innermost of the loops over threads",
             "there is a loop over threads in it", "Reorder it inwards");
    }
    if (!most || *most > warp_threads) {
      refuse(loop, text("a warp has ", warp_threads, " lanes"),
             text("the loop runs ", loop.extent, " times"),
             text("Split it by ", warp_threads, ", and run the inner loop over lanes"));
    }
  }

  [[noreturn]] static void refuse(const For& loop, const std::string& rule,
                                  const std::string& evidence, const std::string& instead) {
    user_error("run GPU threads of " + describe_loop(loop.name), rule, evidence, instead);
  }

  static std::optional<int64_t> largest(const Expr& extent) {
    if (const auto constant = as_const_int(extent)) return std::max<int64_t>(*constant, 0);
    simplification::Facts facts;
    const int64_t most = std::min(facts.range(extent).max, facts.upper_bound(ir::sum_of(extent)));
    return most <= most_threads ? std::optional(std::max<int64_t>(most, 1)) : std::nullopt;
  }

  Kernel& kernel_;
  Substitution lets_;
  int depth_ = 0;
  std::array<int, most_dimensions> most_ = {};
  std::array<bool, most_dimensions> wants_some_ = {};
};

// ---- storage ----

class MemoryChooser : public StatementRewriter {
 protected:
  Stmt rewrite(const Stmt& s) override {
    const auto* loop = s.as<For>();
    if (loop && is_gpu_thread(loop->runs)) {
      ++threads_around_;
      Stmt result = children(s);
      --threads_around_;
      return result;
    }
    const auto* allocation = s.as<Allocate>();
    if (!allocation) return children(s);
    return make_allocate(allocation->name, allocation->type, memory_of(*allocation),
                         allocation->elements, (*this)(allocation->body));
  }

 private:
  [[noreturn]] static void refuse(const Allocate& n, const std::string& rule,
                                  const std::string& evidence, const std::string& instead) {
    user_error(text("store ", quoted(n.name), " in a kernel"), rule, evidence, instead);
  }

  // Whether the storage is small enough for a thread's stack without a request.
  static bool is_small(const Allocate& n) {
    constexpr int64_t most_bytes = 16 << 10;
    const auto elements = as_const_int(n.elements);
    return elements && *elements * n.type.bytes() * n.type.lanes() <= most_bytes;
  }

  MemoryType memory_of(const Allocate& n) const {
    const bool has_inner_threads = has_threads(n.body);
    if (threads_around_ > 0 && has_inner_threads) {
      refuse(n, "nothing is computed between loops over threads",
             "it is computed in one loop over threads, around another one",
             "Compute it in the innermost loop over threads, or outside of all of them");
    }
    if (has_inner_threads) return n.memory == MemoryType::Stack ? MemoryType::Auto : n.memory;
    if (n.memory == MemoryType::Heap) return MemoryType::Heap;
    if (n.memory == MemoryType::GPUShared && threads_around_ > 0) {
      refuse(n, "the threads of a block share what is computed outside of loops over threads",
             "it is computed by each thread", "Compute it in a loop over blocks");
    }
    if (n.memory == MemoryType::Auto && !is_small(n)) return MemoryType::Heap;
    if (!is_const(n.elements)) {
      refuse(n, "the size of a thread's own storage is a constant",
             text("it has ", n.elements, " elements"),
             "Split by constants what computes it, or store it in MemoryType::Heap");
    }
    return MemoryType::Stack;
  }

  int threads_around_ = 0;
};

}  // namespace

void choose_threads(Kernel& kernel) {
  ThreadChooser(kernel).choose();
  kernel.body = MemoryChooser()(kernel.body);
}

}  // namespace retrograde::lower
