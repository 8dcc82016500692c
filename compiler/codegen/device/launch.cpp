// The host's side of a launch: names that the kernel uses but does not define become its arguments.
//
//   launch k blocks(n, 1, 1) threads(32, 1, 1) shared(0) { out[..] = in[..] * gain }
//      =>
//   code = retrograde_to_device(context, in.buffer); the same for out, which may only be allocated
//   code = retrograde_gpu_initialize_kernels(context, &state, &image, bytes)
//   code = retrograde_gpu_run(context, state, "k", n, 1, 1, 32, 1, 1, 0, sizes, {in.buffer, out.buffer,
//                             &gain}, are_buffers)
//   retrograde_device_changed(context, out.buffer)
#include <set>

#include "codegen/device/kernels.h"
#include "codegen/function_generator.h"
#include "codegen/values/calls.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

// Turns the facts of buffers that a kernel reads into variables, because a kernel has no buffer descriptors.
class FactsHoister : public Rewriter {
 public:
  std::vector<std::pair<std::string, Expr>> facts;

 protected:
  Expr rewrite(const Expr& e) override {
    const auto* call = e.as<Call>();
    if (!call || call->call_type != CallType::Operator || !is_buffer_operator(call->op))
      return children(e);
    facts.emplace_back("fact$" + std::to_string(facts.size()), e);
    return variable(facts.back().first, e.type());
  }
};

struct Used {
  std::map<std::string, Type> variables;  // sorted, which is the order of the arguments
  std::map<std::string, bool> storages;   // value: whether it is written
};

Used used_in(const Stmt& s) {
  Used used;
  walk(
      s, [&](const Variable& n) { used.variables.emplace(n.name, n.type); },
      [&](const Load& n) { used.storages.emplace(n.name, false); },
      [&](const Store& n) { used.storages[n.name] = true; });
  return used;
}

}  // namespace

void FunctionGenerator::make(const Launch& s) {
  FactsHoister hoister;
  const Stmt launch = hoister(Stmt(&s));
  const MemoScope scope(c_.frame, false);
  for (const auto& [name, fact] : hoister.facts) c_.frame.variables[name] = values_.of(fact);
  const Launch& n = *launch.as<Launch>();
  std::vector<KernelUse::Argument> arguments;
  const Used used = used_in(n.body);
  for (const auto& [name, is_written] : used.storages) {
    if (c_.frame.storages.count(name)) arguments.push_back({name, Type(), true, is_written});
  }
  for (const auto& [name, type] : used.variables) {
    if (c_.frame.variables.count(name)) arguments.push_back({name, type});
  }
  const KernelUse& kernel = kernels_.add(launch, std::move(arguments));
  std::vector<Value*> blocks;
  Value* has_work = b_.getTrue();
  for (const Expr& count : n.blocks) {
    blocks.push_back(values_.of(count));
    has_work = b_.CreateAnd(has_work, b_.CreateICmpSGT(blocks.back(), b_.getInt32(0)));
  }
  Value* shared_bytes = values_.of(n.shared_bytes);
  c_.if_true(has_work, [&] { run(kernel, blocks, shared_bytes); });
  for (const auto& [name, fact] : hoister.facts) c_.frame.variables.erase(name);
}

void FunctionGenerator::check_call(const std::string& function, const std::vector<Value*>& args) {
  Value* code = c_.call_runtime(function, b_.getInt32Ty(), args);
  c_.fail_unless(b_.CreateICmpEQ(code, b_.getInt32(0)), [&] { return code; });
}

void FunctionGenerator::run(const KernelUse& kernel, const std::vector<Value*>& blocks,
                            Value* shared_bytes) {
  const Launch& launch = *kernel.launch.as<Launch>();
  const size_t count = kernel.arguments.size();
  Value* list = c_.entry_alloca(b_.getPtrTy(), static_cast<int64_t>(count + 1), "kernel.arguments");
  std::vector<llvm::Constant*> sizes, are_buffers;
  for (unsigned i = 0; i < count; ++i) {
    const KernelUse::Argument& argument = kernel.arguments[i];
    Value* given;
    if (argument.is_storage) {
      given = buffer_behind(argument.name);
      check_call("retrograde_to_device", {given});
    } else {
      given = c_.entry_alloca(memory_type(e_, argument.type), 1, argument.name);
      b_.CreateStore(to_memory(e_, argument.type, c_.frame.variables.at(argument.name)), given);
    }
    b_.CreateStore(given, b_.CreateConstGEP1_64(b_.getPtrTy(), list, i));
    sizes.push_back(b_.getInt64(static_cast<uint64_t>(argument.bytes())));
    are_buffers.push_back(b_.getInt8(argument.is_storage));
  }
  sizes.push_back(b_.getInt64(0));
  are_buffers.push_back(b_.getInt8(0));
  check_call("retrograde_gpu_initialize_kernels",
             {kernels_.state(), kernels_.image(), c_.int64(kernels_.image_bytes())});
  std::vector<Value*> args = {b_.CreateLoad(b_.getPtrTy(), kernels_.state()),
                              c_.string_constant(kernel.name)};
  args.insert(args.end(), blocks.begin(), blocks.end());
  for (const int threads : launch.threads)
    args.push_back(b_.getInt32(static_cast<uint32_t>(threads)));
  args.insert(args.end(), {shared_bytes, constant_table(b_.getInt64Ty(), sizes), list,
                           constant_table(b_.getInt8Ty(), are_buffers)});
  check_call("retrograde_gpu_run", args);
  for (const KernelUse::Argument& argument : kernel.arguments) {
    if (argument.is_written)
      c_.call_runtime("retrograde_device_changed", b_.getInt32Ty(), {buffer_behind(argument.name)});
  }
}

Value* FunctionGenerator::buffer_behind(const std::string& storage) {
  const auto found = c_.frame.variables.find(storage + ".buffer");
  RETROGRADE_ASSERT(found != c_.frame.variables.end(), "no buffer behind ", storage,
                    ", which a kernel touches");
  return found->second;
}

llvm::Constant* FunctionGenerator::constant_table(llvm::Type* type,
                                                  const std::vector<llvm::Constant*>& entries) {
  auto* array = llvm::ArrayType::get(type, entries.size());
  return new llvm::GlobalVariable(e_.module, array, true, llvm::GlobalValue::PrivateLinkage,
                                  llvm::ConstantArray::get(array, entries), "kernel.table");
}

}  // namespace retrograde::codegen
