// The node types of Expr and Stmt (node.h). kinds.def lists the node kinds, operators.def the
// operators and their properties. The functions of build.h make nodes and check types; a node's
// children never change. Two handles to one node share it, so expressions are DAGs.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "ir/node.h"

namespace retrograde {
namespace ir {

// ---- expressions ----

// Each node type lists its data besides kind and type once, as its fields: names and numbers, then
// children in evaluation order. Comparison and walks use that list. Symbols are carried along but
// never compared. Nodes have no constructors: make_node takes the members in the order of the
// struct.
//
// make() builds a node through the functions of build.h. These fold constants, so the result may
// have another kind.
// Requires: operands of a node are defined; operands of a node have one type; the condition of a
// node is of type bool.
#define RETROGRADE_FIELDS(...) \
  auto fields() const { return std::tie(__VA_ARGS__); }
#define RETROGRADE_NODE(Name, ...)                                      \
  static constexpr Kind own_kind = Kind::Name;                          \
  static constexpr bool is_kind(Kind kind) { return kind == own_kind; } \
  RETROGRADE_FIELDS(__VA_ARGS__)

struct IntImm : ExprNode {
  RETROGRADE_NODE(IntImm, value)
  static Expr make(Type type, int64_t value);
  const int64_t value;
};
struct UIntImm : ExprNode {
  RETROGRADE_NODE(UIntImm, value)
  static Expr make(Type type, uint64_t value);
  const uint64_t value;
};
struct FloatImm : ExprNode {  // the value is already rounded to the type
  RETROGRADE_NODE(FloatImm, value)
  static Expr make(Type type, double value);
  const double value;
};
struct StringImm : ExprNode {
  RETROGRADE_NODE(StringImm, value)
  static Expr make(const std::string& text) { return Expr(text); }
  const std::string value;
};
// A pure variable, loop variable, let-bound name, scalar parameter, reduction variable, or buffer
// metadata ("input.min.0", "input.extent.1", "input.stride.0").
struct Variable : ExprNode {
  RETROGRADE_NODE(Variable, name)
  static Expr make(Type type, const std::string& name);
  const std::string name;
  const SymbolRef symbol;
};
struct Cast
    : ExprNode {  // integers wrap; float to integer truncates toward zero; to bool means != 0
  RETROGRADE_NODE(Cast, value)
  static Expr make(Type type, Expr value);
  const Expr value;
};
struct Reinterpret : ExprNode {  // same bits, other type
  RETROGRADE_NODE(Reinterpret, value)
  static Expr make(Type type, Expr value);
  const Expr value;
};
struct Binary : ExprNode {
  static constexpr bool is_kind(Kind kind) { return kind >= Kind::Add && kind <= Kind::Or; }
  RETROGRADE_FIELDS(a, b)
  const Expr a, b;

 protected:
  Binary(Kind kind, Type type, Expr a, Expr b)
      : ExprNode(kind, type), a(std::move(a)), b(std::move(b)) {
    has_loose_names = this->a->has_loose_names || this->b->has_loose_names;
  }
};
// Binary nodes of one kind, for use with as<>(): e.as<Add>()->a
template <Kind K>
struct BinaryOf : Binary {
  static constexpr bool is_kind(Kind kind) { return kind == K; }
  BinaryOf(Type type, Expr a, Expr b) : Binary(K, type, std::move(a), std::move(b)) {}
  static Expr make(Expr a, Expr b);
};
#define RETROGRADE_BINARY(Name) using Name = BinaryOf<Kind::Name>;
#include "ir/kinds.def"

struct Not : ExprNode {
  RETROGRADE_NODE(Not, a)
  static Expr make(Expr a);
  const Expr a;
};
struct Select : ExprNode {
  RETROGRADE_NODE(Select, condition, when_true, when_false)
  static Expr make(Expr condition, Expr when_true, Expr when_false);
  const Expr condition, when_true, when_false;
};
// FlatStorage phase: element number `index` of the allocation or buffer `name`.
struct Load : ExprNode {
  RETROGRADE_NODE(Load, name, index, predicate)
  const std::string name;
  const Expr index,
      predicate;           // bool with the load's lanes; disabled lanes have an unspecified value
  const SymbolRef symbol;  // the parameter or buffer; undefined for internal allocations
};
struct Ramp
    : ExprNode {  // base, base + stride, ...; base may be a vector: then lanes are base-major
  RETROGRADE_NODE(Ramp, lanes, base, stride)
  static Expr make(Expr base, Expr stride, int lanes);
  const Expr base, stride;
  const int lanes;
};
struct Broadcast : ExprNode {  // value repeated `lanes` times; value may be a vector (concatenated)
  RETROGRADE_NODE(Broadcast, lanes, value)
  static Expr make(Expr value, int lanes);
  const Expr value;
  const int lanes;
};
enum class CallType : uint8_t {
  Operator,  // `op`, see operators.def
  Func,      // a value of another Func at integer coordinates; symbol: the Func's contents
  Image,     // an element of an ImageParam or Buffer at integer coordinates; symbol: the parameter
  Extern,    // a C function `name` that takes its arguments by value
};
struct Call : ExprNode {
  RETROGRADE_NODE(Call, call_type, op, name, component, args)
  template <class... Ops>
  bool is_op(Ops... which) const {
    return call_type == CallType::Operator && ((op == which) || ...);
  }
  bool is_marker() const { return op_info(op).cls == OpClass::Marker; }
  // Visitors see an operator as an intrinsic, named by its enumerator (Call::likely).
  using enum Op;
  static constexpr CallType Halide = CallType::Func, Image = CallType::Image,
                            Extern = CallType::Extern, PureExtern = CallType::Extern,
                            Intrinsic = CallType::Operator, PureIntrinsic = CallType::Operator;
  bool is_intrinsic() const { return call_type == CallType::Operator; }
  template <class... Ops>
  requires(sizeof...(Ops) >= 1) bool is_intrinsic(Ops... which) const { return is_op(which...); }
  bool is_extern() const { return call_type == CallType::Extern; }
  // Whether this calls a C function whose result depends on its arguments alone and that has no
  // side effects. Such calls are hoisted out of loops in which their arguments do not change.
  bool is_pure_extern() const { return is_extern() && component == pure_extern; }
  static constexpr int pure_extern = 1;
  bool is_pure() const {
    return call_type != CallType::Operator || op_info(op).cls != OpClass::Effect;
  }
  // The call of a C function. Requires: a call by name alone calls a C function.
  static Expr make(Type type, const std::string& name, const std::vector<Expr>& args,
                   CallType call_type = CallType::Extern);
  static Expr make(Type type, Op op, const std::vector<Expr>& args,
                   CallType call_type = CallType::Operator);
  bool is_likely() const { return is_op(Op::likely, Op::likely_if_innermost); }
  const CallType call_type;
  const Op op;             // Op::none unless call_type is Operator
  const std::string name;  // the Func, image or C function; for an operator, its name
  const std::vector<Expr> args;
  const int component;  // Funcs: which value of a Tuple; C functions: pure_extern or 0
  const SymbolRef symbol;
};
// `e` as a call of one of the operators `which`; null when it is not.
template <class... Ops>
const Call* as_op(const Expr& e, Ops... which) {
  const Call* call = e.as<Call>();
  return call && call->is_op(which...) ? call : nullptr;
}
inline bool is_undef(const Expr& e) { return as_op(e, Op::undef) != nullptr; }
struct Let : ExprNode {
  RETROGRADE_NODE(Let, name, value, body)
  static Expr make(const std::string& name, Expr value, Expr body);
  const std::string name;
  const Expr value, body;
};
struct Shuffle : ExprNode {  // lane i = lane indices[i] of the concatenated vectors
  RETROGRADE_NODE(Shuffle, indices, vectors)
  static Expr make(const std::vector<Expr>& vectors, const std::vector<int>& indices);
  static Expr make_interleave(const std::vector<Expr>& vectors);
  static Expr make_concat(const std::vector<Expr>& vectors);
  static Expr make_slice(Expr vector, int begin, int stride, int size);
  const std::vector<Expr> vectors;
  const std::vector<int> indices;
};
// Combines groups of neighbouring lanes into type.lanes() lanes by Add, Mul, Min, Max, And or Or.
struct VectorReduce : ExprNode {
  RETROGRADE_NODE(VectorReduce, op, value)
  const Kind op;
  const Expr value;
};

// ---- statements ----

struct LetStmt : StmtNode {
  RETROGRADE_NODE(LetStmt, name, value, body)
  const std::string name;
  const Expr value;
  const Stmt body;
};
// When the condition is false, the function returns `error` (an int32, see Op::error; 0 means an
// early return without error). With Op::undef as the error, the condition is a fact that an earlier
// check has established: it emits no code.
struct Assert : StmtNode {
  RETROGRADE_NODE(Assert, condition, error)
  const Expr condition, error;
};
struct ProducerConsumer : StmtNode {
  RETROGRADE_NODE(ProducerConsumer, name, produces, body)
  const std::string name;
  const bool produces;
  const Stmt body;
};
struct For : StmtNode {  // name in [min, min + extent)
  RETROGRADE_NODE(For, name, runs, partition, min, extent, body)
  const std::string name;
  const Expr min, extent;
  const ForType runs;
  const Stmt body;
  const Partition partition;
};
struct Store : StmtNode {
  RETROGRADE_NODE(Store, name, value, index, predicate)
  const std::string name;
  const Expr value, index, predicate;
  const SymbolRef symbol;
};
// Loops phase: stores a point of a Func, one value per Tuple element, all at once.
struct Provide : StmtNode {
  RETROGRADE_NODE(Provide, name, values, args, predicate)
  const std::string name;
  const std::vector<Expr> values, args;
  const Expr predicate;
};
// How the points of a Func lie in its storage, and who uses it when.
struct StorageLayout {
  // The dimensions, innermost first; empty: as declared.
  std::vector<int> order;
  // Per dimension: coordinates are stored modulo this. Undefined or missing: not folded.
  std::vector<Expr> folds;
  // The Realize around it that provides the memory; empty: memory of its own.
  std::string place;
  // The element of `place` at which it begins; undefined: 0.
  Expr first;
  // By how many iterations the producer of an async Func may be ahead of its consumer; 0: any number.
  int lead = 1;
};
struct Realize : StmtNode {  // Loops phase: storage for a Func over a box, alive during body
  RETROGRADE_NODE(Realize, name, types, memory, bounds, layout, body)
  const std::string name;
  const std::vector<Type> types;
  const MemoryType memory;
  const std::vector<Range> bounds;
  const StorageLayout layout;
  const Stmt body;
};
struct Allocate
    : StmtNode {  // FlatStorage phase: `elements` (int64) elements of `type`, alive during body
  RETROGRADE_NODE(Allocate, name, type, memory, elements, offset, body)
  const std::string name;
  const Type type;
  const MemoryType memory;
  const Expr elements;
  const Expr offset;  // GPUShared in a Launch: byte offset into shared memory; else undefined
  const Stmt body;
};
// No use of the allocation follows; at most one on each path of its Allocate's body.
struct Free : StmtNode {
  RETROGRADE_NODE(Free, name)
  const std::string name;
};
struct Block : StmtNode {
  RETROGRADE_NODE(Block, stmts)
  const std::vector<Stmt> stmts;
};
struct IfThenElse : StmtNode {
  RETROGRADE_NODE(IfThenElse, condition, when_true, when_false)
  const Expr condition;
  const Stmt when_true, when_false;  // when_false may be undefined
};
struct Evaluate : StmtNode {
  RETROGRADE_NODE(Evaluate, value)
  const Expr value;
};

struct Atomic : StmtNode {  // body's reads and writes of one element of `name` are indivisible
  RETROGRADE_NODE(Atomic, name, body)
  const std::string name;
  const Stmt body;
};
struct Fork : StmtNode {  // both may run concurrently; ends when both have ended
  RETROGRADE_NODE(Fork, first, rest)
  const Stmt first, rest;
};
struct Prefetch : StmtNode {  // Loops phase: fetches a box of a Func or image into the cache
  RETROGRADE_NODE(Prefetch, name, type, bounds)
  const std::string name;
  const Type type;
  const std::vector<Range> bounds;
  const SymbolRef symbol;  // the image; undefined for a Func
};

// FlatStorage and Vector phases: runs a kernel over a grid of `blocks`, each of `threads`, both
// given for x, y and z. The body is the code of one thread, which finds its position in the
// variables of thread_index and block_index. The variables and memory that it uses from outside are
// the kernel's arguments. `shared_bytes` (int32) is the size of the memory that the threads of a
// block share; the body's GPUShared allocations lie there.
struct Launch : StmtNode {
  RETROGRADE_NODE(Launch, name, blocks, threads, shared_bytes, body)
  const std::string name;
  const std::vector<Expr> blocks;
  const std::vector<int> threads;
  const Expr shared_bytes;
  const Stmt body;
};
// Variables (int32) of a launch's body: the position of the thread in its block, or of the block in
// the grid.
std::string thread_index(const std::string& kernel, int dimension);
std::string block_index(const std::string& kernel, int dimension);

#undef RETROGRADE_NODE
#undef RETROGRADE_FIELDS

inline bool has_loose_names(const Expr& e) { return e.defined() && e->has_loose_names; }
inline bool has_loose_names(const std::vector<Expr>& all) {
  for (const Expr& e : all)
    if (has_loose_names(e)) return true;
  return false;
}
template <class Field>
constexpr bool has_loose_names(const Field&) {  // for a name or a number
  return false;
}

template <std::derived_from<ExprNode> N, class... Members>
const N* make_node(Type type, Members&&... members) {
  const N* node = new N{{N::own_kind, type}, std::forward<Members>(members)...};
  node->has_loose_names = std::apply(
      [](const auto&... fields) { return (has_loose_names(fields) || ...); }, node->fields());
  return node;
}
template <std::derived_from<StmtNode> N, class... Members>
const N* make_node(Members&&... members) {
  return new N{{N::own_kind}, std::forward<Members>(members)...};
}

}  // namespace ir
}  // namespace retrograde
