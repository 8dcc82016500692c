// Calls of the runtime that lowering puts in: functions by name, values packed into memory, events.
#include <HalideRuntime.h>

#include "codegen/function_generator.h"
#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::codegen {

using namespace ir;

// (function, args...): function(context, args...).
Value* FunctionGenerator::runtime_call(const Call& e) {
  const auto* name = e.args[0].as<StringImm>();
  RETROGRADE_ASSERT(name != nullptr, "a runtime call of no name");
  std::vector<Value*> args;
  for (size_t i = 1; i < e.args.size(); i++) {
    RETROGRADE_ASSERT(e.args[i].type().is_scalar(), "a vector goes to ", name->value);
    args.push_back(value(e.args[i]));
  }
  Value* result = call_runtime(name->value, llvm_type(e_, e.type), args);
  if (name->value == "retrograde_profiler_begin") {
    frame_.profiler_slot = entry_alloca(b_.getPtrTy(), 1, "profiled");
    b_.CreateStore(result, frame_.profiler_slot);
  } else if (name->value == "retrograde_profiler_end" && frame_.profiler_slot) {
    b_.CreateStore(null_pointer(), frame_.profiler_slot);
  }
  return result;
}

// The bytes of the values as they lie in memory, without gaps.
Value* FunctionGenerator::pack(const std::vector<Expr>& parts) {
  int64_t bytes = 0;
  for (const Expr& part : parts) bytes += int64_t{part.type().bytes()} * part.type().lanes();
  llvm::AllocaInst* block = entry_alloca(b_.getInt8Ty(), std::max<int64_t>(bytes, 1), "packed");
  block->setAlignment(llvm::Align(16));
  uint64_t offset = 0;
  for (const Expr& part : parts) {
    const Type type = part.type();
    Value* at = b_.CreateConstGEP1_64(b_.getInt8Ty(), block, offset);
    b_.CreateAlignedStore(to_memory(type, value(part)), at, llvm::Align(1));
    offset += static_cast<uint64_t>(type.bytes()) * static_cast<uint64_t>(type.lanes());
  }
  return block;
}

// (address): a hint, and no access: the address may be anything.
Value* FunctionGenerator::prefetch(const Call& e) {
  b_.CreateIntrinsic(llvm::Intrinsic::prefetch, {b_.getPtrTy()},
                     {value(e.args[0]), b_.getInt32(0), b_.getInt32(3), b_.getInt32(1)});
  return b_.getInt32(0);
}

// (value, event, func, value index, parent, coordinates...): a halide_trace_event_t on the stack.
Value* FunctionGenerator::trace(const Call& e) {
  constexpr size_t first_coordinate = 5;
  const auto element = [](const Expr& arg) {
    const auto* splat = arg.as<Broadcast>();
    return splat ? splat->value : arg;
  };
  const auto constant = [&](const Expr& arg) {
    return b_.getInt32(static_cast<uint32_t>(as_const_int(element(arg)).value_or(0)));
  };
  const std::vector<Expr> coordinates(e.args.begin() + first_coordinate, e.args.end());
  uint32_t dimensions = 0;
  for (const Expr& coordinate : coordinates)
    dimensions += static_cast<uint32_t>(coordinate.type().lanes());
  llvm::AllocaInst* event =
      entry_alloca(b_.getInt8Ty(), sizeof(halide_trace_event_t), "trace_event");
  event->setAlignment(llvm::Align(16));
  const auto set = [&](size_t offset, Value* field) {
    b_.CreateStore(field, b_.CreateConstGEP1_64(b_.getInt8Ty(), event, offset));
  };
  set(offsetof(halide_trace_event_t, func), value(element(e.args[2])));
  set(offsetof(halide_trace_event_t, value), pack({e.args[0]}));
  set(offsetof(halide_trace_event_t, coordinates), pack(coordinates));
  set(offsetof(halide_trace_event_t, trace_tag), null_pointer());
  set(offsetof(halide_trace_event_t, type), b_.getInt32(type_word(e.type)));
  set(offsetof(halide_trace_event_t, event), constant(e.args[1]));
  set(offsetof(halide_trace_event_t, parent_id), lane(e_, value(e.args[4]), 0));
  set(offsetof(halide_trace_event_t, value_index), constant(e.args[3]));
  set(offsetof(halide_trace_event_t, dimensions), b_.getInt32(dimensions));
  call_runtime("retrograde_trace", b_.getInt32Ty(), {event});
  return value(e.args[0]);
}

}  // namespace retrograde::codegen
