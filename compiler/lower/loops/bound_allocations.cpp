// bound_allocations -- give small storage of varying size a constant size, the maximum.
// In:  FlatStorage or Vector; names unique.
// Out: the same phase; the same stores in the same order.
//
//   for (xo, 0, (n + 7) / 8) {                       for (xo, 0, (n + 7) / 8) {
//     allocate f[min(n - 8*xo, 8)] { ... }     =>      allocate f[8] { ... }
//   }                                                }
//
// Storage of constant size is on the stack, which costs nothing. The last tile of a split computes less than the
// others, and its varying size would otherwise put the storage of all tiles on the heap. So would the size of a box
// whose ends are quotients, as (min + 1) / 2 - min / 2 + 10, which is 11 at most.
//
// Method: constant upper bounds of sizes, as for loops (bounded_extents.h), for sizes that mention few names.
// Not done: storage that is scheduled on the heap or a device; kernels, whose storage is already placed.
// Source: folklore. Tests: test/golden/lower/bound_allocations/, test/unit/lower/loop_schedules_test.cpp.
#include <algorithm>

#include "ir/build.h"
#include "lower/loops/bounded_extents.h"
#include "lower/statement_passes.h"

namespace retrograde::lower {

namespace {

// The limits in bytes up to which code generation uses the stack: by default, and for MemoryType::Stack.
constexpr int64_t most_unasked = 16 << 10, most_asked = 256 << 10;
// A limit on the names in a size and in their values, so that the time is linear in the number of stages.
constexpr int most_names = 20;

class AllocationBounder : public BoundedExtents {
 protected:
  Stmt rewrite(const Stmt& s) override {
    if (s.as<Launch>()) return s;
    const Stmt inner = parts(s);
    const auto* n = inner.as<Allocate>();
    if (!n || is_const(n->elements) || n->offset.defined()) return inner;
    const bool is_asked = n->memory == MemoryType::Stack;
    if ((!is_asked && n->memory != MemoryType::Auto) ||
        !mentions_few_names(n->elements, most_names))
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
