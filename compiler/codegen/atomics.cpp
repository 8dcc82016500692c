// Updates of one element from several iterations at once.
//
//   one value of at most 64 bits   an instruction where there is one (integers: + - min max & | ^;
//                                  floats: + -), else compare-and-swap until nobody came between
//   a Tuple                        a lock of the runtime, chosen by its first element's address
//
// All updates of one element go the same way: instructions and compare-and-swap exclude each other,
// and whether locks are needed depends on the Func alone. A vector is updated lane by lane, so that
// lanes may hit one element.
//
// Relaxed ordering is enough: what an update publishes is the element itself, and the end of the
// parallel loop orders everything else.
#include <unordered_set>

#include "codegen/function_generator.h"
#include "diagnostics/error.h"
#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

using BinOp = llvm::AtomicRMWInst::BinOp;
constexpr auto relaxed = llvm::AtomicOrdering::Monotonic;

static BinOp instruction_for(const AtomicUpdate& update, Type type) {
  if (type.is_bool()) return BinOp::BAD_BINOP;
  if (type.is_float())
    return update.kind != Kind::Add || is_half(type) ? BinOp::BAD_BINOP
           : update.is_negated                       ? BinOp::FSub
                                                     : BinOp::FAdd;
  switch (update.kind) {
    case Kind::Add:
      return update.is_negated ? BinOp::Sub : BinOp::Add;
    case Kind::Min:
      return type.is_int() ? BinOp::Min : BinOp::UMin;
    case Kind::Max:
      return type.is_int() ? BinOp::Max : BinOp::UMax;
    default:
      return update.op == Op::bitwise_and   ? BinOp::And
             : update.op == Op::bitwise_or  ? BinOp::Or
             : update.op == Op::bitwise_xor ? BinOp::Xor
                                            : BinOp::BAD_BINOP;
  }
}

void FunctionGenerator::make(const Atomic& s) {
  const auto* store = s.body.as<Store>();
  if (store && is_one_word(store->value.type())) return atomic_store(*store);
  const Store* first = nullptr;
  walk(
      s.body, [](const Expr&) { return false; },
      [&](const Stmt& part) {
        if (!first) first = part.as<Store>();
        return !first;
      });
  if (first) locked(s, *first);
}

void FunctionGenerator::atomic_store(const Store& s) {
  const MemoScope scope(*this, false);
  const Type element = s.value.type().element_of();
  const auto update = find_atomic_update(s);
  if (!update) return compare_and_swap(s);
  Value* operand = value(update->operand);
  Value* predicate = predicate_value(s.predicate);
  const int lanes = s.value.type().lanes();
  Value* indices = lanes == 1 ? index64(s.index) : index_vector(s.index);
  const Storage& to = storage(s.name);
  const BinOp op = instruction_for(*update, element);
  for (int i = 0; i < lanes; i++) {
    Value* index = b_.CreateSExt(lane(e_, indices, i), b_.getInt64Ty());
    Value* one = lane(e_, operand, i);
    const auto apply = [&] {
      Value* pointer = element_pointer(to, element, index);
      if (op != BinOp::BAD_BINOP) return atomic_instruction({op, pointer, one}, to);
      compare_and_swap(element, pointer, to, [&](Value* old) {
        if (update->op != Op::none)
          return simple_operator(e_, update->op, element, {element, element}, {old, one});
        return binary(e_, update->is_negated ? Kind::Sub : update->kind, element, old, one);
      });
    };
    predicate ? if_true(lane(e_, predicate, i), apply) : apply();
  }
}

void FunctionGenerator::atomic_instruction(const AtomicLane& lane, const Storage& to) {
  tagged(b_.CreateAtomicRMW(lane.op, lane.pointer, lane.operand, llvm::MaybeAlign(), relaxed), to);
}

// Stores updated(old) where old was, as often as it takes until it still is there.
void FunctionGenerator::compare_and_swap(Type type, Value* pointer, const Storage& to,
                                         const std::function<Value*(Value*)>& updated) {
  auto* memory = memory_type(e_, type);
  const auto bytes = static_cast<uint64_t>(type.bytes());
  auto* word = b_.getIntNTy(static_cast<unsigned>(8 * bytes));
  auto* first = tagged(b_.CreateAlignedLoad(word, pointer, llvm::Align(bytes)), to);
  first->setAtomic(relaxed);
  llvm::BasicBlock *before = b_.GetInsertBlock(), *attempt = new_block("attempt"),
                   *after = new_block("updated");
  b_.CreateBr(attempt);
  b_.SetInsertPoint(attempt);
  llvm::PHINode* old = b_.CreatePHI(word, 2);
  old->addIncoming(first, before);
  Value* next = to_memory(type, updated(from_memory(type, b_.CreateBitCast(old, memory))));
  auto* swap = tagged(b_.CreateAtomicCmpXchg(pointer, old, b_.CreateBitCast(next, word),
                                             llvm::Align(bytes), relaxed, relaxed),
                      to);
  old->addIncoming(b_.CreateExtractValue(swap, 0), b_.GetInsertBlock());
  b_.CreateCondBr(b_.CreateExtractValue(swap, 1), after, attempt);
  b_.SetInsertPoint(after);
}

namespace {

// Nodes on a way from an expression down to a load of the stored element.
struct OwnLoads {
  explicit OwnLoads(const Store& store) : store_(store) { depends(store.value); }
  std::vector<Expr> nodes;

  bool depends(const Expr& e) {
    const auto found = known_.find(e.get());
    if (found != known_.end()) return found->second;
    const auto* load = e.as<Load>();
    bool result = load && load->name == store_.name && equal(load->index, store_.index);
    if (result) nodes.push_back(e);
    if (!result) for_each_child(e, [&](const Expr& child) { result |= depends(child); });
    known_[e.get()] = result;
    return result;
  }

 private:
  const Store& store_;
  std::unordered_map<const ExprNode*, bool> known_;
};

// The largest parts that do not depend on the element and are computed whatever it holds.
void independent_parts(const Expr& e, OwnLoads& own, std::unordered_set<const ExprNode*>& seen,
                       std::vector<Expr>& parts) {
  if (!seen.insert(e.get()).second) return;
  if (!own.depends(e)) {
    if (e.kind() != Kind::Variable && !is_const(e) && e.kind() != Kind::StringImm)
      parts.push_back(e);
    return;
  }
  if (const auto* let = e.as<Let>()) return independent_parts(let->value, own, seen, parts);
  const auto* call = e.as<Call>();
  const bool is_lazy = call && (call->is_op(Op::if_then_else) || call->is_op(Op::require) ||
                                call->is_op(Op::print) || call->is_op(Op::print_when));
  if (is_lazy) return independent_parts(call->args[0], own, seen, parts);
  for_each_child(e, [&](const Expr& child) { independent_parts(child, own, seen, parts); });
}

}  // namespace

void FunctionGenerator::compare_and_swap(const Store& s) {
  const Type type = s.value.type();
  RETROGRADE_ASSERT(type.is_scalar(), "an atomic vector update of ", quoted(s.name),
                    " that is no single operation");
  Value* predicate = predicate_value(s.predicate);
  Value* index = index64(s.index);
  const auto update = [&] {
    OwnLoads own(s);
    std::unordered_set<const ExprNode*> seen;
    std::vector<Expr> parts;
    independent_parts(s.value, own, seen, parts);
    for (const Expr& part : parts) value(part);
    const Storage& to = storage(s.name);
    compare_and_swap(type, element_pointer(to, type, index), to, [&](Value* old) {
      const MemoScope attempt(*this, true);
      for (const Expr& node : own.nodes) frame_.memo.back().values[node.get()] = {node, old};
      return value(s.value);
    });
  };
  predicate ? if_true(predicate, update) : update();
}

// The address is known before the lock: what the index is made of is bound inside.
void FunctionGenerator::locked(const Atomic& s, const Store& first) {
  Substitution lets;
  for (const auto* let = s.body.as<LetStmt>(); let; let = let->body.as<LetStmt>())
    lets[let->name] = substitute(let->value, lets);
  Value* element;
  {
    const MemoScope scope(*this, false);
    const Expr index = substitute(first.index, lets);
    RETROGRADE_ASSERT(index.type().is_scalar(), "a lock for a vector of ", quoted(s.name));
    element = element_pointer(storage(first.name), first.value.type().element_of(), index64(index));
  }
  call_runtime("retrograde_lock_element", b_.getVoidTy(), {element});
  statement(s.body);
  call_runtime("retrograde_unlock_element", b_.getVoidTy(), {element});
}

}  // namespace retrograde::codegen
