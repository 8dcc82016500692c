// bound_allocations -- storage that is small whatever its size is has a constant size, the largest one.
// In:  FlatStorage or Vector; names unique.
// Out: the same phase; the same stores in the same order.
//
//   for (xo, 0, (n + 7) / 8) {                       for (xo, 0, (n + 7) / 8) {
//     allocate f[min(n - 8*xo, 8)] { ... }     =>      allocate f[8] { ... }
//   }                                                }
//
// What has a constant size is memory of the stack, which costs nothing; the last tile of a split has
// less to compute than the others and would make all of them ask for memory.
//
// Method: constants above sizes as for loops (bounded_extents.h), where a size is made of few names.
// Not done: memory that asks for the heap or a device; kernels, whose storage is placed before.
// Source: folklore. Tests: test/golden/lower/bound_allocations/, test/unit/loop_schedules_test.cpp.
#include <algorithm>

#include "ir/build.h"
#include "lower/loops/bounded_extents.h"
#include "lower/statement_passes.h"

namespace retrograde::lower {

namespace {

// In bytes: what code generation puts on the stack.
constexpr int64_t most_unasked = 16 << 10, most_asked = 256 << 10;
// In a size and in the values of those names, so that chains of stages take time by their number.
constexpr int most_names = 20;

class AllocationBounder : public BoundedExtents {
 protected:
  Stmt rewrite(const Stmt& s) override {
    if (s.as<Launch>()) return s;
    const Stmt inner = parts(s);
    const auto* n = inner.as<Allocate>();
    if (!n || is_const(n->elements) || n->offset.defined()) return inner;
    const bool is_asked = n->memory == MemoryType::Stack;
    if ((!is_asked && n->memory != MemoryType::Auto) || !is_made_of_few(n->elements, most_names))
      return inner;
    const int64_t bytes = int64_t{n->type.bytes()} * n->type.lanes();
    const auto most = largest(n->elements, (is_asked ? most_asked : most_unasked) / bytes);
    if (!most) return inner;
    const Expr elements = make_const(n->elements.type(), std::max<int64_t>(*most, 1));
    return make_allocate(n->name, n->type, n->memory, elements, n->body);
  }
};

}  // namespace

Stmt bound_allocations(const Stmt& s) { return AllocationBounder()(s); }

}  // namespace retrograde::lower
