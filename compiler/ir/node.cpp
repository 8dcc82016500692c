// The table of kinds, destruction of nodes, and immediates from C++ values.
#include "ir/build.h"
#include "ir/expr.h"

namespace retrograde {

namespace ir {

const char* kind_name(Kind kind) {
  static constexpr const char* names[] = {
#define RETROGRADE_EXPR(Kind) #Kind,
#define RETROGRADE_BINARY(Kind) #Kind,
#define RETROGRADE_STMT(Kind) #Kind,
#include "ir/kinds.def"
  };
  return names[static_cast<int>(kind)];
}

static constexpr const char* axes[] = {".x", ".y", ".z"};
std::string thread_index(const std::string& kernel, int dimension) {
  return kernel + ".thread" + axes[dimension];
}
std::string block_index(const std::string& kernel, int dimension) {
  return kernel + ".block" + axes[dimension];
}

namespace {

void destroy(const Node* node) {
  switch (node->kind) {
#define RETROGRADE_EXPR(K) \
  case Kind::K:            \
    return delete static_cast<const K*>(node);
#define RETROGRADE_BINARY(K) RETROGRADE_EXPR(K)
#define RETROGRADE_STMT(K) RETROGRADE_EXPR(K)
#include "ir/kinds.def"
  }
}

}  // namespace

// Deleting a node drops its children, which may call this function again: the outermost call queues
// those, and owns the queue on its stack. (A thread_local queue with a destructor would be
// destroyed before the last static Expr.)
void release(const Node* node) noexcept {
  thread_local std::vector<const Node*>* pending = nullptr;
  if (pending) {
    pending->push_back(node);
    return;
  }
  std::vector<const Node*> queue;
  pending = &queue;
  destroy(node);
  while (!queue.empty()) {
    const Node* next = queue.back();
    queue.pop_back();
    destroy(next);
  }
  pending = nullptr;
}

}  // namespace ir

Expr Expr::of_bool(bool value) { return ir::make_uint_const(Bool(), value); }
Expr::Expr(int8_t value) : Expr(ir::make_const(Int(8), int64_t{value})) {}
Expr::Expr(int16_t value) : Expr(ir::make_const(Int(16), int64_t{value})) {}
Expr::Expr(int32_t value) : Expr(ir::make_const(Int(32), int64_t{value})) {}
Expr::Expr(int64_t value) : Expr(ir::make_const(Int(64), value)) {}
Expr::Expr(uint8_t value) : Expr(ir::make_uint_const(UInt(8), value)) {}
Expr::Expr(uint16_t value) : Expr(ir::make_uint_const(UInt(16), value)) {}
Expr::Expr(uint32_t value) : Expr(ir::make_uint_const(UInt(32), value)) {}
Expr::Expr(uint64_t value) : Expr(ir::make_uint_const(UInt(64), value)) {}
Expr::Expr(float16_t value) : Expr(ir::make_const(Float(16), static_cast<double>(value))) {}
Expr::Expr(bfloat16_t value) : Expr(ir::make_const(BFloat(16), static_cast<double>(value))) {}
Expr::Expr(float value) : Expr(ir::make_const(Float(32), static_cast<double>(value))) {}
Expr::Expr(double value) : Expr(ir::make_const(Float(64), value)) {}
Expr::Expr(const std::string& text) : Ref(ir::make_node<ir::StringImm>(Handle(), text)) {}
Expr::Expr(const char* text) {
  if (!text) {
    user_error("make an Expr from a text", "a text is not null", "the pointer to it is null",
               "Give it a text, or a number such as 0");
  }
  *this = Expr(std::string(text));
}

}  // namespace retrograde
