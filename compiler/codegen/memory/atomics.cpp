// Atomic updates: several parallel iterations may update the same element.
//
//   one value of at most 64 bits   an instruction if there is one (integers: + - min max & | ^;
//                                  floats: + -), else a compare-and-swap loop
//   a Tuple                        a lock of the runtime, chosen by its first element's address
//
// All updates of one element use compatible methods: instructions and compare-and-swap exclude each other, and whether
// locks are needed depends only on the Func. Vectors are updated lane by lane, because lanes may hit the same element.
//
// Relaxed ordering is enough: an update publishes only the element itself, and the end of the parallel loop orders
// everything else.
#include <unordered_set>

#include "codegen/function_generator.h"
#include "codegen/memory/access.h"
#include "diagnostics/error.h"
#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

using BinOp = llvm::AtomicRMWInst::BinOp;
constexpr auto relaxed = llvm::AtomicOrdering::Monotonic;

namespace {

BinOp instruction_for(const AtomicUpdate& update, Type type) {
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

// Replaces the stored value by updated(old), and retries until no other thread has changed it in between.
void compare_and_swap(FunctionContext& c, Type type, Value* pointer, const Storage& to,
                      const std::function<Value*(Value*)>& updated) {
  auto* memory = memory_type(c.e, type);
  const auto bytes = static_cast<uint64_t>(type.bytes());
  auto* word = c.b.getIntNTy(static_cast<unsigned>(8 * bytes));
  auto* first = tagged(c.b.CreateAlignedLoad(word, pointer, llvm::Align(bytes)), to);
  first->setAtomic(relaxed);
  llvm::BasicBlock *before = c.b.GetInsertBlock(), *attempt = c.new_block("attempt"),
                   *after = c.new_block("updated");
  c.b.CreateBr(attempt);
  c.b.SetInsertPoint(attempt);
  llvm::PHINode* old = c.b.CreatePHI(word, 2);
  old->addIncoming(first, before);
  Value* next =
      to_memory(c.e, type, updated(from_memory(c.e, type, c.b.CreateBitCast(old, memory))));
  auto* swap = tagged(c.b.CreateAtomicCmpXchg(pointer, old, c.b.CreateBitCast(next, word),
                                              llvm::Align(bytes), relaxed, relaxed),
                      to);
  old->addIncoming(c.b.CreateExtractValue(swap, 0), c.b.GetInsertBlock());
  c.b.CreateCondBr(c.b.CreateExtractValue(swap, 1), after, attempt);
  c.b.SetInsertPoint(after);
}

// The nodes on a path from an expression down to a load of the element being updated.
struct OwnLoads {
  explicit OwnLoads(const Store& store) : store_(store) { depends(store.value); }
  std::vector<Expr> nodes;

  bool depends(const Expr& e) {
    if (const auto* found = ir::find_or_null(known_, e.get())) return *found;
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

// The largest subexpressions that do not depend on the element and are evaluated whatever its value.
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

void compare_and_swap(Values& values, const Store& s) {
  FunctionContext& c = values.c;
  const Type type = s.value.type();
  RETROGRADE_ASSERT(type.is_scalar(), "an atomic vector update of ", quoted(s.name),
                    " that is no single operation");
  Value* predicate = values.predicate(s.predicate);
  Value* index = values.index64(s.index);
  const auto update = [&] {
    OwnLoads own(s);
    std::unordered_set<const ExprNode*> seen;
    std::vector<Expr> parts;
    independent_parts(s.value, own, seen, parts);
    for (const Expr& part : parts) values.of(part);
    const Storage& to = c.storage(s.name);
    compare_and_swap(c, type, element_pointer(c.e, to, type, index), to, [&](Value* old) {
      const MemoScope attempt(c.frame, true);
      for (const Expr& node : own.nodes) c.frame.memo.back().values[node.get()] = {node, old};
      return values.of(s.value);
    });
  };
  predicate ? c.if_true(predicate, update) : update();
}

}  // namespace

void atomic_store(Values& values, const Store& s) {
  FunctionContext& c = values.c;
  const MemoScope scope(c.frame, false);
  const Type element = s.value.type().element_of();
  const auto update = find_atomic_update(s);
  if (!update) return compare_and_swap(values, s);
  Value* operand = values.of(update->operand);
  Value* predicate = values.predicate(s.predicate);
  const int lanes = s.value.type().lanes();
  Value* indices = lanes == 1 ? values.index64(s.index) : values.index_vector(s.index);
  const Storage& to = c.storage(s.name);
  BinOp op = instruction_for(*update, element);
  if (op == BinOp::FSub && c.e.machine.is_device()) {  // devices have no atomic subtraction
    op = BinOp::FAdd;
    operand = c.b.CreateFNeg(operand);
  }
  for (int i = 0; i < lanes; i++) {
    Value* index = c.b.CreateSExt(lane(c.e, indices, i), c.b.getInt64Ty());
    Value* one = lane(c.e, operand, i);
    const auto apply = [&] {
      Value* pointer = element_pointer(c.e, to, element, index);
      if (op != BinOp::BAD_BINOP)
        return void(tagged(c.b.CreateAtomicRMW(op, pointer, one, llvm::MaybeAlign(), relaxed), to));
      compare_and_swap(c, element, pointer, to, [&](Value* old) {
        if (update->op != Op::none)
          return simple_operator(c.e, update->op, element, {element, element}, {old, one});
        return binary(c.e, update->is_negated ? Kind::Sub : update->kind, element, old, one);
      });
    };
    predicate ? c.if_true(lane(c.e, predicate, i), apply) : apply();
  }
}

void FunctionGenerator::make(const Atomic& s) {
  const auto* store = s.body.as<Store>();
  const bool is_one = store && is_one_word(store->value.type());
  if (is_one && !touches_several_elements(s.body)) return atomic_store(values_, *store);
  const Store* first = nullptr;
  any_stmt(s.body, [&](const Stmt& part) { return (first = part.as<Store>()) != nullptr; });
  if (!first) return;
  if (device_) {
    unsupported("update " + quoted(s.name) + " atomically on a GPU",
                "a kernel updates one value of at most 64 bits at a time",
                "updating a Tuple or several points together needs a lock",
                "Reduce with rfactor, or update a Func for each value");
  }
  locked(s, *first);
}

// The address is computed before the lock is taken, so the bindings of its variables inside the Atomic are substituted.
// An update of several elements takes the lock of the buffer's first element: all updates that may meet it take the
// same lock.
void FunctionGenerator::locked(const Atomic& s, const Store& first) {
  Substitution lets;
  for (const auto* let = s.body.as<LetStmt>(); let; let = let->body.as<LetStmt>())
    lets[let->name] = substitute(let->value, lets);
  Value* element;
  {
    const MemoScope scope(c_.frame, false);
    const Expr index = touches_several_elements(s.body) ? Expr(0) : substitute(first.index, lets);
    RETROGRADE_ASSERT(index.type().is_scalar(), "a lock for a vector of ", quoted(s.name));
    element = element_pointer(e_, c_.storage(first.name), first.value.type().element_of(),
                              values_.index64(index));
  }
  c_.call_runtime("retrograde_lock_element", b_.getVoidTy(), {element});
  statement(s.body);
  c_.call_runtime("retrograde_unlock_element", b_.getVoidTy(), {element});
}

}  // namespace retrograde::codegen
