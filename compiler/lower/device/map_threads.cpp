// map_threads -- replace loops over threads by the work of one thread. T: the number of threads in the dimension.
//
//   gpu_thread for (x, a, T) { body }         let x = a + thread.x  body
//   gpu_thread for (x, a, n) { body }   =>    if (thread.x < n) { let x = a + thread.x  body }     n <= T
//                                             for (k, 0, (n + T - 1) / T) {                      else
//                                               let p = k * T + thread.x
//                                               if (p < n) { let x = a + p  body }
//                                             }
//
// Code outside the loops of a dimension runs on the first thread of that dimension.
#include <algorithm>

#include "diagnostics/error.h"
#include "ir/visit.h"
#include "lower/device/kernel.h"
#include "lower/expand_lets_in_scope.h"
#include "lower/nests/copy_statement.h"
#include "simplify/facts.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

class ThreadMapper {
 public:
  explicit ThreadMapper(const Kernel& kernel) : kernel_(kernel), fresh_(kernel.body) {}

  Stmt run() { return visit(kernel_.body); }

 private:
  Stmt visit(const Stmt& s) {
    if (!s.defined()) return s;
    if (const auto* let = s.as<LetStmt>()) lets_[let->name] = let->value;
    if (!has_threads(s)) return by_first_thread(s);
    const auto* loop = s.as<For>();
    if (loop && is_gpu_thread(loop->runs)) return mapped(*loop);
    return map_children(s, [&](const Stmt& part) { return visit(part); });
  }

  Expr thread(int dimension) const { return variable(thread_index(kernel_.name, dimension)); }
  int count(int dimension) const { return kernel_.threads[static_cast<size_t>(dimension)]; }

  // Runs `s` on the first thread of the dimensions that no loop covers; barriers run on all threads.
  Stmt by_first_thread(const Stmt& s) const {
    const auto* call = s.as<Evaluate>();
    if (call && (as_op(call->value, Op::gpu_barrier) || as_op(call->value, Op::gpu_warp_barrier)))
      return s;
    Expr is_first = make_const(Bool(), int64_t{1});
    for (int d = 0; d < 3; ++d) {
      if (!covered_[static_cast<size_t>(d)] && count(d) > 1) is_first = is_first && thread(d) == 0;
    }
    return make_if(simplify(is_first), s);
  }

  Stmt mapped(const For& loop) {
    const int dimension = thread_depth(loop.body), threads = count(dimension);
    bool& covered = covered_[static_cast<size_t>(dimension)];
    covered = true;
    const Stmt body = visit(loop.body);
    covered = false;
    const Expr extent = simplify(loop.extent);
    const auto known = as_const_int(extent);
    const int64_t most = known ? *known : largest(extent);
    const auto at = [&](const Expr& place) { return make_let(loop.name, loop.min + place, body); };
    if (known && *known == threads) return at(thread(dimension));
    if (most <= threads) return make_if(thread(dimension) < extent, at(thread(dimension)));
    const std::string turn = fresh_(loop.name + ".turn"), place = fresh_(loop.name + ".place");
    const Expr turns = simplify((extent + (threads - 1)) / threads);
    const bool is_full = known && *known % threads == 0;
    const Stmt one =
        is_full ? at(variable(place)) : make_if(variable(place) < extent, at(variable(place)));
    return make_for(turn, 0, turns, ForType::Serial,
                    make_let(place, variable(turn) * threads + thread(dimension), one));
  }

  // An upper bound of the extent. Lets hold the ends of tiles, so the bound may only appear with lets expanded.
  int64_t largest(const Expr& extent) const {
    simplification::Facts facts;
    const Expr full = simplify(expand_lets_in_scope(extent, lets_));
    return std::min({facts.upper_bound(ir::sum_of(extent)), facts.upper_bound(ir::sum_of(full)),
                     facts.range(full).max});
  }

  const Kernel& kernel_;
  Substitution lets_;
  FreshNames fresh_;
  std::array<bool, 3> covered_ = {};
};

}  // namespace

void map_threads(Kernel& kernel) { kernel.body = ThreadMapper(kernel).run(); }

}  // namespace retrograde::lower
