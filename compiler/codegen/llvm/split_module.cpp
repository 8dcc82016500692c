#include "codegen/llvm/split_module.h"

#include <llvm/IR/Module.h>
#include <llvm/Transforms/Utils/Cloning.h>

#include <algorithm>
#include <map>

#include "codegen/llvm/unit.h"

namespace retrograde::codegen {
namespace {

// From this number of instructions on, LLVM takes several times as long to compile them as it takes to start a thread,
// transfer them to it and initialise LLVM there.
constexpr unsigned worth_a_thread = 300;
// Fewer instructions do not make a part on their own.
constexpr unsigned small_function = 100;

using PartOf = std::map<const llvm::GlobalValue*, unsigned>;

std::vector<const llvm::Function*> largest_first(const llvm::Module& module) {
  std::vector<const llvm::Function*> functions;
  for (const llvm::Function& function : module) {
    if (!function.isDeclaration()) functions.push_back(&function);
  }
  std::stable_sort(functions.begin(), functions.end(), [](const auto* a, const auto* b) {
    return a->getInstructionCount() > b->getInstructionCount();
  });
  return functions;
}

PartOf assign(const std::vector<const llvm::Function*>& functions, unsigned parts) {
  std::vector<unsigned> sizes(parts, 0);
  PartOf result;
  for (const llvm::Function* function : functions) {
    const auto least = std::min_element(sizes.begin(), sizes.end());
    *least += function->getInstructionCount();
    result[function] = static_cast<unsigned>(least - sizes.begin());
  }
  return result;
}

bool is_local_constant(const llvm::GlobalValue& value) {
  const auto* variable = llvm::dyn_cast<llvm::GlobalVariable>(&value);
  return variable && variable->isConstant() && variable->hasLocalLinkage();
}

// Makes the value visible to the other parts, and only to them. Unnamed values get a name here, because LLVM would
// number them differently in each part.
void share(llvm::GlobalValue& value) {
  if (!value.hasLocalLinkage()) return;
  if (!value.hasName()) value.setName("shared");
  value.setLinkage(llvm::GlobalValue::ExternalLinkage);
  value.setVisibility(llvm::GlobalValue::HiddenVisibility);
}

void erase_unused_constants(llvm::Module& module) {
  for (llvm::GlobalVariable& variable : llvm::make_early_inc_range(module.globals())) {
    if (is_local_constant(variable) && variable.use_empty()) variable.eraseFromParent();
  }
}

// Number of functions with at least `least` instructions.
unsigned functions_of(const llvm::Module& module, unsigned least) {
  return static_cast<unsigned>(std::count_if(module.begin(), module.end(), [&](const auto& f) {
    return !f.isDeclaration() && f.getInstructionCount() >= least;
  }));
}

}  // namespace

unsigned possible_parts(const llvm::Module& module, unsigned asked) {
  return std::min(asked, std::max(1u, functions_of(module, 0)));
}

unsigned worthwhile_parts(const llvm::Module& module, unsigned most) {
  const unsigned size = module.getInstructionCount() / worth_a_thread;
  return std::max(1u, std::min({size, functions_of(module, small_function), most}));
}

void split_into_bitcode(llvm::Module& module, unsigned parts, const UsePart& use) {
  const std::vector<const llvm::Function*> functions = largest_first(module);
  const PartOf part_of = assign(functions, parts);
  for (llvm::Function& function : module) share(function);
  for (llvm::GlobalVariable& variable : module.globals()) {
    if (!is_local_constant(variable)) share(variable);
  }
  for (unsigned part = 0; part < parts; part++) {
    llvm::ValueToValueMapTy copies;
    const auto belongs_here = [&](const llvm::GlobalValue* value) {
      return is_local_constant(*value) || ir::value_or(part_of, value, 0) == part;
    };
    const std::unique_ptr<llvm::Module> copy = llvm::CloneModule(module, copies, belongs_here);
    erase_unused_constants(*copy);
    use(part, bitcode_of(*copy));
  }
}

}  // namespace retrograde::codegen
