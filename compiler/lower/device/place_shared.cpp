// place_shared -- assign offsets in shared memory to the storage of a block.
//
// Allocations that are alive at the same time get consecutive offsets, at multiples of 16 bytes; others share bytes.
// The nest of allocations acts as a stack: an allocation that begins after another one ended reuses its offset.
//
//   allocate a[64]:float32 gpu_shared {            allocate a[64]:float32 gpu_shared at 0 {
//     allocate b[64]:float32 gpu_shared {..}   =>    allocate b[64]:float32 gpu_shared at 256 {..}
//     allocate c[64]:float32 gpu_shared {..}         allocate c[64]:float32 gpu_shared at 256 {..}
//   }                                              }                             512 bytes in total
#include "diagnostics/error.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/device/size_bounds.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int alignment_bytes = 16;  // the size of the widest access

class SharedPlacer : public StatementRewriter {
 public:
  SharedPlacer(const Kernel& kernel, int limit_bytes) : sizes_(kernel), limit_bytes_(limit_bytes) {}
  Expr most_bytes() const { return most_; }
  const std::vector<std::string>& names() const { return names_; }

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const auto* let = s.as<LetStmt>()) sizes_.define(*let);
    if (const auto* loop = s.as<For>()) return in_loop(*loop);
    const auto* n = s.as<Allocate>();
    if (!n || (n->memory != MemoryType::GPUShared && n->memory != MemoryType::Auto))
      return children(s);
    if (n->memory == MemoryType::Auto && !fits(*n))
      return make_allocate(n->name, n->type, MemoryType::Heap, n->elements, (*this)(n->body));
    names_.push_back(n->name);
    const Expr begin = used_, bytes = bytes_of(*n);
    used_ = simplify(begin + bytes);
    most_ = simplify(max(most_, used_));
    const Stmt body = (*this)(n->body);
    used_ = begin;
    return make_allocate(n->name, n->type, MemoryType::GPUShared, n->elements, body, begin);
  }

 private:
  Stmt in_loop(const For& loop) {
    sizes_.enter(loop);
    Stmt result = children(Stmt(&loop));
    sizes_.leave(loop);
    return result;
  }

  // Whether the allocation fits for every block.
  bool fits(const Allocate& n) {
    const Expr elements = sizes_.most(n.elements);
    if (!elements.defined()) return false;
    const int64_t unknown = int64_t{limit_bytes_} + 1;
    const int64_t count = as_const_int(elements).value_or(unknown),
                  before = as_const_int(used_).value_or(unknown);
    return count <= limit_bytes_ &&
           before + count * n.type.bytes() * n.type.lanes() + alignment_bytes <= limit_bytes_;
  }

  Expr bytes_of(const Allocate& n) {
    const Expr elements = sizes_.most(n.elements);
    // Earlier passes reject regions that depend on data.
    RETROGRADE_ASSERT(elements.defined(), "nothing bounds the size of ", quoted(n.name));
    const int element_bytes = n.type.bytes() * n.type.lanes();
    // Exceeds every device limit but not 32 bits, so that the launch fails with a clear error.
    constexpr int too_many = 1 << 20;
    return simplify((min(elements, too_many) * element_bytes + (alignment_bytes - 1)) /
                    alignment_bytes * alignment_bytes);
  }

  Expr used_ = 0, most_ = 0;
  SizeBounds sizes_;
  const int limit_bytes_;
  std::vector<std::string> names_;
};

}  // namespace

void place_shared(Kernel& kernel, int limit_bytes) {
  SharedPlacer placer(kernel, limit_bytes);
  kernel.body = placer(kernel.body);
  kernel.shared_bytes = placer.most_bytes();
  const auto bytes = as_const_int(kernel.shared_bytes);
  if (!bytes || *bytes <= limit_bytes) return;
  const auto list = listed(placer.names(), [](const std::string& name) { return quoted(name); });
  user_error(text("store ", list, " in shared memory"),
             "a block has at most as many bytes of it as the target says",
             text("they need ", *bytes, " bytes, and there are ", limit_bytes),
             "Make the tiles smaller, or store one of them in MemoryType::Heap or Register");
}

}  // namespace retrograde::lower
