// LLVM's back end for NVPTX compiles everything that codegen/device/selectable.h lists; the rest would
// abort the process.
#include "codegen/device/selectable.h"

#include <gtest/gtest.h>
#include <llvm/AsmParser/Parser.h>
#include <llvm/IR/IRBuilder.h>
#include <llvm/Support/SourceMgr.h>

#include "codegen/llvm/unit.h"
#include "support/expect_ptxas.h"

namespace retrograde::codegen {
namespace {

namespace Intrinsic = llvm::Intrinsic;

Machine nvptx(Target::Feature capability) {
  const Target target = get_host_target().with_feature(Target::CUDA).with_feature(capability);
  return device_machine(machine_for(target, false), Machine::Device::Nvptx);
}

// The types to try each intrinsic with.
std::vector<llvm::Type*> types_of(llvm::Intrinsic::ID id, llvm::LLVMContext& context) {
  llvm::SmallVector<Intrinsic::IITDescriptor> table;
  Intrinsic::getIntrinsicInfoTableEntries(id, table);
  const auto wants = [&](Intrinsic::IITDescriptor::ArgKind kind) {
    for (const auto& one : table) {
      if (one.Kind == Intrinsic::IITDescriptor::Argument && one.getArgumentKind() == kind)
        return true;
    }
    return false;
  };
  llvm::Type *f16 = llvm::Type::getHalfTy(context), *f32 = llvm::Type::getFloatTy(context),
             *f64 = llvm::Type::getDoubleTy(context), *i8 = llvm::Type::getInt8Ty(context),
             *i16 = llvm::Type::getInt16Ty(context), *i32 = llvm::Type::getInt32Ty(context),
             *i64 = llvm::Type::getInt64Ty(context);
  const auto vector = [](llvm::Type* type) { return llvm::FixedVectorType::get(type, 4); };
  if (wants(Intrinsic::IITDescriptor::AK_AnyFloat))
    return {f16, f32, f64, vector(f16), vector(f32), vector(f64)};
  if (wants(Intrinsic::IITDescriptor::AK_AnyVector))
    return {vector(f32), vector(f64), vector(i8), vector(i16), vector(i32), vector(i64)};
  std::vector<llvm::Type*> integers = {i16, i32, i64, vector(i16), vector(i32), vector(i64)};
  if (id != Intrinsic::bswap) integers.push_back(i8);
  return integers;
}

// Adds a function of the intrinsic's arguments that calls it.
void call_in(llvm::Module& module, llvm::Function* intrinsic, int number) {
  llvm::FunctionType* type = intrinsic->getFunctionType();
  auto* caller = llvm::Function::Create(type, llvm::GlobalValue::ExternalLinkage,
                                        "f" + std::to_string(number), module);
  llvm::IRBuilder<> b(llvm::BasicBlock::Create(module.getContext(), "", caller));
  std::vector<llvm::Value*> args;
  for (unsigned i = 0; i < caller->arg_size(); ++i) {
    const bool is_constant = intrinsic->hasParamAttribute(i, llvm::Attribute::ImmArg);
    args.push_back(is_constant
                       ? static_cast<llvm::Value*>(llvm::ConstantInt::get(
                             type->getParamType(i), type->getParamType(i)->isIntegerTy(1) ? 0 : 4))
                       : caller->getArg(i));
  }
  llvm::Value* result = b.CreateCall(intrinsic, args);
  if (type->getReturnType()->isVoidTy()) {
    b.CreateRetVoid();
  } else {
    b.CreateRet(result);
  }
}

bool suits(Intrinsic::ID id, llvm::Type* type) {
  const llvm::StringRef name = Intrinsic::getBaseName(id);
  if (name.starts_with("llvm.vector.reduce.f")) return type->isFPOrFPVectorTy();
  if (name.starts_with("llvm.vector.reduce.")) return type->isIntOrIntVectorTy();
  return true;
}

std::vector<llvm::Type*> overloads(Intrinsic::ID id, llvm::Type* type) {
  llvm::LLVMContext& context = type->getContext();
  llvm::Type *pointer = llvm::PointerType::get(context, 0), *i32 = llvm::Type::getInt32Ty(context);
  switch (id) {
    case Intrinsic::masked_load:
    case Intrinsic::masked_store:
      return {type, pointer};
    case Intrinsic::masked_gather:
    case Intrinsic::masked_scatter:
      return {type, llvm::FixedVectorType::get(pointer, 4)};
    case Intrinsic::fptosi_sat:
    case Intrinsic::fptoui_sat:
      return {type->getWithNewType(i32), type};
    default:
      return {type};
  }
}

std::vector<Intrinsic::ID> of_values() {
  std::vector<Intrinsic::ID> ids;
  for (const Intrinsic::ID id : selectable_intrinsics()) {
    // These describe memory, and every kernel uses them.
    switch (id) {
      case Intrinsic::lifetime_start:
      case Intrinsic::lifetime_end:
      case Intrinsic::assume:
      case Intrinsic::experimental_noalias_scope_decl:
      case Intrinsic::memcpy:
      case Intrinsic::memset:
      case Intrinsic::memmove:
        break;
      default:
        ids.push_back(id);
    }
  }
  return ids;
}

class Selectable : public testing::TestWithParam<Target::Feature> {};

TEST_P(Selectable, WhatIsListedIsTranslated) {
  const Machine machine = nvptx(GetParam());
  Unit unit(machine, "listed", true);
  int count = 0;
  for (const Intrinsic::ID id : of_values()) {
    for (llvm::Type* type : types_of(id, unit.module().getContext())) {
      if (!suits(id, type)) continue;
      call_in(unit.module(), Intrinsic::getDeclaration(&unit.module(), id, overloads(id, type)),
              count++);
    }
  }
  EXPECT_GT(count, 150);
  EXPECT_EQ(find_unselectable(unit.module()), "");
  const std::string ptx = unit.emit_last(llvm::CodeGenFileType::AssemblyFile);
  EXPECT_NE(ptx.find("f" + std::to_string(count - 1)), std::string::npos);
  EXPECT_EQ(ptx.find(".extern"), std::string::npos) << "a function that no device has";
  expect_ptxas_takes(ptx, machine.cpu);
}

INSTANTIATE_TEST_SUITE_P(Chips, Selectable,
                         testing::Values(Target::CUDACapability75, Target::CUDACapability80,
                                         Target::CUDACapability86, Target::CUDACapability90),
                         [](const auto& chip) { return nvptx(chip.param).cpu; });

std::string found_in(const std::string& body, const std::string& before = "") {
  llvm::LLVMContext context;
  llvm::SMDiagnostic error;
  const auto module = llvm::parseAssemblyString(
      before +
          "declare float @sinf(float)\ndeclare float @llvm.sin.f32(float)\n"
          "define float @f(ptr %p, float %a, i32 %i) {\n" +
          body + "\n  ret float %a\n}\n",
      error, context);
  return module ? find_unselectable(*module) : "no IR: " + error.getMessage().str();
}

TEST(NotSelectable, IsFound) {
  const std::pair<const char*, const char*> cases[] = {
      {"fence seq_cst", "a fence"},
      {"fence syncscope(\"singlethread\") seq_cst", "a fence"},
      {"%r = frem float %a, %a", "a remainder of floats"},
      {"%r = call float @sinf(float %a)", "a call of a function of the host"},
      {"%r = call float @llvm.sin.f32(float %a)", "an intrinsic"},
      {"%r = atomicrmw add ptr %p, i32 %i seq_cst", "an order of atomics"},
      {"%r = cmpxchg ptr %p, i32 %i, i32 %i acq_rel monotonic", "an order of atomics"},
      {"store atomic i32 %i, ptr %p release, align 4", "an order of stores"},
      {"%r = load atomic i32, ptr %p acquire, align 4", "an order of loads"},
      {"%r = fpext float %a to fp128", "a float of 16 bytes"},
      {"%r = call float %p(float %a)", "a call of an address"},
  };
  for (const auto& [body, problem] : cases)
    EXPECT_EQ(found_in(body).rfind(problem, 0), 0u) << body << ": " << found_in(body);
  EXPECT_EQ(found_in("%r = load float, ptr @table", "@table = external global float\n"),
            "a variable of the host: table");
  EXPECT_EQ(found_in("%r = atomicrmw fadd ptr %p, float %a monotonic"), "");
  EXPECT_EQ(found_in("%r = fdiv float %a, %a"), "");
}

}  // namespace
}  // namespace retrograde::codegen
