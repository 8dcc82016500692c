// Expr and Stmt: handles to immutable, reference-counted nodes. expr.h has the node types.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "ir/lists.h"
#include "ir/operators.h"
#include "ir/type.h"

namespace retrograde {

namespace ir {

class IRVisitor;  // ir/visitor.h

enum class Kind : uint8_t {
#define RETROGRADE_EXPR(Kind) Kind,
#define RETROGRADE_BINARY(Kind) Kind,
#define RETROGRADE_STMT(Kind) Kind,
#include "ir/kinds.def"
};
const char* kind_name(Kind kind);

struct Node {
  Node(Kind kind) : kind(kind) {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  mutable std::atomic<int> references{0};
  const Kind kind;
};
struct ExprNode : Node {
  ExprNode(Kind kind, Type type) : Node(kind), type(type) {}
  // Whether the expression mentions a name that no definition owns yet (loose_variable in build.h).
  mutable bool has_loose_names = false;
  const Type type;
  mutable std::atomic<uint64_t> hash{0};  // structural (equal.h); 0 until first computed
};
struct StmtNode : Node {
  using Node::Node;
};

// Deletes the node by its dynamic kind, without recursing on the C++ stack: chains of a million
// nodes are legal.
void release(const Node* node) noexcept;

template <class T>
class Ref {
 public:
  Ref() = default;
  Ref(const T* node) : node_(node) { retain(); }
  Ref(const Ref& other) : node_(other.node_) { retain(); }
  Ref(Ref&& other) noexcept : node_(std::exchange(other.node_, nullptr)) {}
  Ref& operator=(Ref other) noexcept {
    std::swap(node_, other.node_);
    return *this;
  }
  ~Ref() {
    if (node_ && node_->references.fetch_sub(1, std::memory_order_acq_rel) == 1) release(node_);
  }

  bool defined() const { return node_ != nullptr; }
  bool same_as(const Ref& other) const { return node_ == other.node_; }
  const T* get() const { return node_; }
  const T* operator->() const { return node_; }
  Kind kind() const { return node_->kind; }
  // The node as a concrete type (ir::Select, ...), or null when it has another kind.
  template <class N>
  const N* as() const {
    return node_ && N::is_kind(node_->kind) ? static_cast<const N*>(static_cast<const Node*>(node_))
                                            : nullptr;
  }

 private:
  void retain() const {
    if (node_) node_->references.fetch_add(1, std::memory_order_relaxed);
  }
  const T* node_ = nullptr;
};

}  // namespace ir

// A scalar or vector expression. Constructing one from a C++ constant gives an immediate of that
// type.
class Expr : public ir::Ref<ir::ExprNode> {
 public:
  using Ref::Ref;
  Expr() = default;
  // Accepts only a real bool, so that pointers do not convert to conditions.
  template <typename T>
  requires std::same_as<T, bool> Expr(T value) : Expr(of_bool(value)) {}
  Expr(int8_t value);
  Expr(int16_t value);
  Expr(int32_t value);
  Expr(int64_t value);
  Expr(uint8_t value);
  Expr(uint16_t value);
  Expr(uint32_t value);
  Expr(uint64_t value);
  Expr(float16_t value);
  Expr(bfloat16_t value);
  Expr(float value);
  Expr(double value);
  Expr(long long value) : Expr(static_cast<int64_t>(value)) {}
  Expr(unsigned long long value) : Expr(static_cast<uint64_t>(value)) {}
  Expr(const std::string& text);
  // Explicit, so that an overload set of a string and an Expr takes a literal as the string.
  // Requires: a text is not null.
  explicit Expr(const char* text);
  Type type() const { return get()->type; }
  // Calls the visitor's function for the node's type; see ir/visitor.h.
  void accept(ir::IRVisitor* visitor) const;

 private:
  static Expr of_bool(bool value);
};

class Stmt : public ir::Ref<ir::StmtNode> {
 public:
  using Ref::Ref;
};

struct ExprCompare {  // compares identity, not value
  bool operator()(const Expr& a, const Expr& b) const { return a.get() < b.get(); }
};

// [min, min + extent)
struct Range {
  Expr min, extent;
};

// With GpuBlock, GpuThread and GpuLane, iterations are blocks of a grid, threads of a block and
// lanes of a warp.
enum class ForType : uint8_t {
  Serial,
  Parallel,
  Vectorized,
  Unrolled,
  GpuBlock,
  GpuThread,
  GpuLane
};
constexpr bool is_gpu(ForType type) { return type >= ForType::GpuBlock; }
constexpr bool is_gpu_thread(ForType type) { return type > ForType::GpuBlock; }
// Whether iterations may run concurrently.
constexpr bool runs_at_once(ForType type) { return type == ForType::Parallel || is_gpu(type); }
// Whether a loop is partitioned into a steady state without boundary tests, a prologue and an
// epilogue.
enum class Partition : uint8_t { Auto, Never, Always };
// Register and GPUShared are memories of GPU kernels. Those of other accelerators parse, but
// compiling for them is an error.
enum class MemoryType : uint8_t {
  Auto,
  Heap,
  Stack,
  Register,
  GPUShared,
  GPUTexture,
  LockedCache,
  VTCM,
  AMXTile
};

namespace ir {

// The entity behind a name in the IR: a Func, a parameter, a buffer or a reduction domain. Higher
// layers derive their contents from it; the IR only carries the reference.
struct Symbol {
  virtual ~Symbol() = default;
};

// A reference to a Symbol. A Func's own update definitions hold a weak one, so that no reference
// cycle keeps itself alive.
class SymbolRef {
 public:
  SymbolRef() = default;
  SymbolRef(std::shared_ptr<Symbol> symbol) : strong_(std::move(symbol)), raw_(strong_.get()) {}
  static SymbolRef weak(const std::shared_ptr<Symbol>& symbol) {
    SymbolRef result;
    result.weak_ = symbol;
    result.raw_ = symbol.get();
    return result;
  }
  bool defined() const { return raw_ != nullptr; }
  bool is_weak() const { return raw_ && !strong_; }
  Symbol* raw() const { return raw_; }  // for identity; may dangle when the reference is weak
  std::shared_ptr<Symbol> lock() const { return strong_ ? strong_ : weak_.lock(); }

 private:
  std::shared_ptr<Symbol> strong_;
  std::weak_ptr<Symbol> weak_;
  Symbol* raw_ = nullptr;
};

}  // namespace ir
}  // namespace retrograde
