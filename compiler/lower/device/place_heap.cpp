// place_heap -- allocate device memory once for all blocks or threads of a kernel, and give each its part.
//
//   launch k blocks(n, 1, 1) threads(32, 1, 1) {       allocate a[100 * n]:float32 heap {
//     allocate a[100]:float32 heap {                     launch k blocks(n, 1, 1) threads(32, 1, 1) {
//       a[i] = ..                                   =>      a[block.x * 100 + i] = ..
//     }                                                  }
//   }                                                  }
//
// Each part has the maximum size over all blocks and threads.
#include "diagnostics/error.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/device/size_bounds.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

class HeapPlacer : public Rewriter {
 public:
  explicit HeapPlacer(Kernel& kernel) : kernel_(kernel), sizes_(kernel) {
    const auto linear = [&](const auto& index, const auto& count) {
      Expr result = 0;
      for (int d = 2; d >= 0; --d)
        result = result * count(static_cast<size_t>(d)) + variable(index(kernel.name, d));
      return simplify(result);
    };
    const auto blocks = [&](size_t d) { return kernel.blocks[d]; };
    const auto threads = [&](size_t d) { return Expr(kernel.threads[d]); };
    block_ = linear(block_index, blocks);
    thread_ = linear(thread_index, threads);
  }

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const auto* let = s.as<LetStmt>()) sizes_.define(*let);
    if (const auto* loop = s.as<For>()) return in_loop(*loop);
    if (const auto* store = s.as<Store>(); store && parts_.count(store->name)) {
      const auto n = children(s);
      const auto& same = *n.as<Store>();
      return make_store(same.name, same.value, moved(same.name, same.index), same.predicate);
    }
    const auto* n = s.as<Allocate>();
    if (!n || n->memory != MemoryType::Heap) return children(s);
    place(*n);
    return (*this)(n->body);
  }

  Expr rewrite(const Expr& e) override {
    const auto* load = e.as<Load>();
    if (!load || !parts_.count(load->name)) return children(e);
    const Expr n = children(e);
    const auto& same = *n.as<Load>();
    return make_load(same.type, same.name, moved(same.name, same.index), same.predicate,
                     same.symbol);
  }

 private:
  Stmt in_loop(const For& loop) {
    const bool is_threads = is_gpu_thread(loop.runs);
    threads_around_ += is_threads;
    sizes_.enter(loop);
    Stmt result = children(Stmt(&loop));
    sizes_.leave(loop);
    threads_around_ -= is_threads;
    return result;
  }

  void place(const Allocate& n) {
    const Expr elements = sizes_.most(n.elements);
    // Earlier passes reject regions that depend on data.
    RETROGRADE_ASSERT(elements.defined(), "nothing bounds the size of ", quoted(n.name));
    const bool is_threads_own = threads_around_ > 0;
    const int owners = kernel_.threads[0] * kernel_.threads[1] * kernel_.threads[2];
    const Expr number = is_threads_own ? block_ * owners + thread_ : block_;
    // Computed in 64 bits: the allocation reports sizes above 31 bits.
    Expr all = cast_to(Int(64), elements);
    if (is_threads_own) all = all * make_const(Int(64), owners);
    for (const Expr& blocks : kernel_.blocks) all = all * cast_to(Int(64), blocks);
    kernel_.heap.push_back({n.name, n.type, simplify(all)});
    parts_[n.name] = simplify(number * elements);
  }

  Expr moved(const std::string& name, const Expr& index) const {
    const Expr& begin = parts_.at(name);
    const int lanes = index.type().lanes();
    return (lanes == 1 ? begin : make_broadcast(begin, lanes)) + index;
  }

  Kernel& kernel_;
  Expr block_, thread_;
  SizeBounds sizes_;
  Substitution parts_;  // the first element of each part
  int threads_around_ = 0;
};

}  // namespace

void place_heap(Kernel& kernel) { kernel.body = HeapPlacer(kernel)(kernel.body); }

}  // namespace retrograde::lower
