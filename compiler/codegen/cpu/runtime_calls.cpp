// Runtime calls that lowering inserts: functions by name, values packed into memory, trace events.
#include <HalideRuntime.h>

#include "codegen/values/calls.h"
#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

struct PairedCall {
  const char *begins, *ends;
};
constexpr PairedCall paired_calls[] = {
    {"retrograde_profiler_begin", "retrograde_profiler_end"},
    {"retrograde_profiler_thread", "retrograde_profiler_leave"},
    {"retrograde_device_buffer", "retrograde_device_buffer_free"},
    {"retrograde_overwrite_begin", "retrograde_overwrite_end"},
};

// Ensures that an early exit also ends what a paired call has begun.
void record_exit_call(FunctionContext& c, const std::string& name, Value* result) {
  for (const PairedCall& call : paired_calls) {
    if (name == call.begins) {
      c.frame.exit_calls.push_back({call.ends, c.entry_alloca(c.b.getPtrTy(), 1, "due")});
      c.b.CreateStore(result, c.frame.exit_calls.back().argument);
    }
    if (name != call.ends) continue;
    // Calls are nested, so this ends the latest one that is still due.
    for (auto due = c.frame.exit_calls.rbegin(); due != c.frame.exit_calls.rend(); ++due) {
      if (due->function != name) continue;
      c.b.CreateStore(c.null_pointer(), due->argument);
      break;
    }
  }
}

// Arguments: (place, func). One volatile store that aliases nothing else, so it stays in place and delays no other
// access.
Value* enter(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  llvm::StoreInst* store =
      c.b.CreateAlignedStore(values.of(e.args[2]), values.of(e.args[1]), llvm::Align(4), true);
  store->setMetadata(llvm::LLVMContext::MD_tbaa, alias_tag(c.e, "places of the profiler"));
  return c.b.getInt32(0);
}

}  // namespace

// (function, args...): calls function(context, args...).
Value* runtime_call(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  const auto* name = e.args[0].as<StringImm>();
  RETROGRADE_ASSERT(name != nullptr, "a runtime call of no name");
  if (name->value == "retrograde_profiler_enter") return enter(values, e);
  std::vector<Value*> args;
  for (size_t i = 1; i < e.args.size(); i++) {
    RETROGRADE_ASSERT(e.args[i].type().is_scalar(), "a vector goes to ", name->value);
    args.push_back(values.of(e.args[i]));
  }
  Value* result = c.call_runtime(name->value, llvm_type(c.e, e.type), args);
  record_exit_call(c, name->value, result);
  return result;
}

// Stores the values one after another, without padding, and returns their address.
Value* pack(Values& values, const std::vector<Expr>& parts) {
  FunctionContext& c = values.c;
  int64_t bytes = 0;
  for (const Expr& part : parts) bytes += int64_t{part.type().bytes()} * part.type().lanes();
  llvm::AllocaInst* block = c.entry_alloca(c.b.getInt8Ty(), std::max<int64_t>(bytes, 1), "packed");
  block->setAlignment(llvm::Align(16));
  uint64_t offset = 0;
  for (const Expr& part : parts) {
    const Type type = part.type();
    Value* at = c.b.CreateConstGEP1_64(c.b.getInt8Ty(), block, offset);
    c.b.CreateAlignedStore(to_memory(c.e, type, values.of(part)), at, llvm::Align(1));
    offset += static_cast<uint64_t>(type.bytes()) * static_cast<uint64_t>(type.lanes());
  }
  return block;
}

// (address): a prefetch hint. It is not an access, so any address is valid. Devices ignore it: other threads run while
// one waits for memory.
Value* prefetch(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  if (c.e.machine.is_device()) return c.b.getInt32(0);
  c.b.CreateIntrinsic(llvm::Intrinsic::prefetch, {c.b.getPtrTy()},
                      {values.of(e.args[0]), c.b.getInt32(0), c.b.getInt32(3), c.b.getInt32(1)});
  return c.b.getInt32(0);
}

// (value, event, func, value index, parent, coordinates...): builds a halide_trace_event_t on the stack.
Value* trace(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  constexpr size_t first_coordinate = 5;
  const auto element = [](const Expr& arg) {
    const auto* splat = arg.as<Broadcast>();
    return splat ? splat->value : arg;
  };
  const auto constant = [&](const Expr& arg) {
    return c.b.getInt32(static_cast<uint32_t>(as_const_int(element(arg)).value_or(0)));
  };
  const std::vector<Expr> coordinates(e.args.begin() + first_coordinate, e.args.end());
  uint32_t dimensions = 0;
  for (const Expr& coordinate : coordinates)
    dimensions += static_cast<uint32_t>(coordinate.type().lanes());
  llvm::AllocaInst* event =
      c.entry_alloca(c.b.getInt8Ty(), sizeof(halide_trace_event_t), "trace_event");
  event->setAlignment(llvm::Align(16));
  const auto set = [&](size_t offset, Value* field) {
    c.b.CreateStore(field, c.b.CreateConstGEP1_64(c.b.getInt8Ty(), event, offset));
  };
  set(offsetof(halide_trace_event_t, func), values.of(element(e.args[2])));
  set(offsetof(halide_trace_event_t, value), pack(values, {e.args[0]}));
  set(offsetof(halide_trace_event_t, coordinates), pack(values, coordinates));
  set(offsetof(halide_trace_event_t, trace_tag), c.null_pointer());
  set(offsetof(halide_trace_event_t, type), c.b.getInt32(type_word(e.type)));
  set(offsetof(halide_trace_event_t, event), constant(e.args[1]));
  set(offsetof(halide_trace_event_t, parent_id), lane(c.e, values.of(e.args[4]), 0));
  set(offsetof(halide_trace_event_t, value_index), constant(e.args[3]));
  set(offsetof(halide_trace_event_t, dimensions), c.b.getInt32(dimensions));
  c.call_runtime("retrograde_trace", c.b.getInt32Ty(), {event});
  return values.of(e.args[0]);
}

}  // namespace retrograde::codegen
