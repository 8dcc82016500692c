// Statements as separate functions: bodies of parallel loops, branches of forks, loops of long functions. A struct on
// the caller's stack (the closure) passes a function the values that its statement uses from outside.
//
//   body   =>   closure = {a, b, &block};   task(context, x, &closure)
//
//   int32 task(context, x, closure): a = closure->a ...; body
//
// Statements that are equal up to names, and to constant distances in memory, share one function, with a closure each:
// steps of an unrolled loop are compiled once. The alias tags of such a function are those of its first statement, so it is not inlined into code that uses
// other tags for the same memory.
#include <algorithm>
#include <set>

#include "codegen/function_generator.h"
#include "ir/shifted_renaming.h"
#include "ir/visit.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

// Every name in a statement, including those that it binds itself. Sorted, so that the closure's layout is
// deterministic.
struct Names {
  std::set<std::string> variables, storages, blocks;
};
Names names_in(const Stmt& s) {
  Names names;
  walk(
      s, [&](const Variable& n) { names.variables.insert(n.name); },
      [&](const Load& n) { names.storages.insert(n.name); },
      [&](const Store& n) { names.storages.insert(n.name); },
      [&](const Allocate& n) { names.blocks.insert(n.name); });
  return names;
}

std::vector<std::string> renamed(const std::vector<std::string>& names, const Renaming& others) {
  return ir::mapped(names, [&](const std::string& name) { return others.at(name); });
}

// The function's own memory has one address in all calls.
bool are_among(const std::unordered_map<std::string, Shift>& shifts,
               const std::vector<std::string>& storages) {
  return std::ranges::all_of(shifts, [&](const auto& one) {
    return std::ranges::find(storages, one.first) != storages.end();
  });
}

}  // namespace

FunctionGenerator::Captures FunctionGenerator::captures_of(const Stmt& body,
                                                           const std::string& index) const {
  const Names names = names_in(body);
  Captures captures;
  std::ranges::copy_if(
      names.variables, std::back_inserter(captures.variables),
      [&](const std::string& name) { return name != index && c_.frame.variables.contains(name); });
  std::ranges::copy_if(names.storages, std::back_inserter(captures.storages),
                       [&](const std::string& name) { return c_.frame.storages.contains(name); });
  captures.blocks.assign(names.blocks.begin(), names.blocks.end());
  return captures;
}

// nullopt: one of them has no value here.
std::optional<std::vector<Value*>> FunctionGenerator::values_of(const Captures& captures) {
  std::vector<Value*> values;
  for (const std::string& name : captures.variables) {
    const auto found = c_.frame.variables.find(name);
    if (found == c_.frame.variables.end()) return std::nullopt;
    values.push_back(found->second);
  }
  for (const std::string& name : captures.storages) {
    const auto found = c_.frame.storages.find(name);
    if (found == c_.frame.storages.end()) return std::nullopt;
    values.push_back(found->second.base);
  }
  for (const std::string& name : captures.blocks) values.push_back(c_.block_name(name));
  return values;
}

// For each storage the first one with its alias tag.
std::vector<size_t> FunctionGenerator::aliases_of(const Captures& captures) const {
  const auto tags = ir::mapped(
      captures.storages, [&](const std::string& name) { return c_.frame.storages.at(name).alias; });
  return ir::mapped(tags, [&](llvm::MDNode* tag) {
    return static_cast<size_t>(std::ranges::find(tags, tag) - tags.begin());
  });
}

Value* FunctionGenerator::make_closure(llvm::StructType* type, const std::vector<Value*>& values,
                                       const std::string& name) {
  Value* closure = c_.entry_alloca(type, 1, name + ".closure");
  for (unsigned i = 0; i < values.size(); i++)
    b_.CreateStore(values[i], b_.CreateStructGEP(type, closure, i));
  return closure;
}

std::optional<FunctionGenerator::Task> FunctionGenerator::shared_task(const Stmt& body,
                                                                      const std::string& index,
                                                                      const std::string& name) {
  for (const Outlined& task : outlined_) {
    if (task.index.empty() != index.empty()) continue;
    Renaming known;
    if (!index.empty()) known[task.index] = index;
    const auto equal = shifted_renaming(task.body, body, known);
    if (!equal || !are_among(equal->shifts, task.captures.storages)) continue;
    const Captures captures{renamed(task.captures.variables, equal->names),
                            renamed(task.captures.storages, equal->names),
                            renamed(task.captures.blocks, equal->names)};
    auto values = values_of(captures);
    const auto has_type = [](const Value* value, const llvm::Type* field) {
      return value->getType() == field;
    };
    if (!values || !std::ranges::equal(*values, task.closure->elements(), has_type) ||
        aliases_of(captures) != task.aliases)
      continue;
    for (size_t i = 0; i < captures.storages.size(); ++i) {
      const auto* shift = find_or_null(equal->shifts, task.captures.storages[i]);
      Value*& base = (*values)[captures.variables.size() + i];
      if (shift)
        base = b_.CreateGEP(b_.getInt8Ty(), base,
                            b_.getInt64(static_cast<uint64_t>(shift->elements) *
                                        static_cast<uint64_t>(shift->type.bytes())));
    }
    task.function->addFnAttr(llvm::Attribute::NoInline);
    return Task{task.function, make_closure(task.closure, *values, name)};
  }
  return std::nullopt;
}

FunctionGenerator::Task FunctionGenerator::outline(const Stmt& body, const std::string& what,
                                                   const std::string& name,
                                                   const std::string& index, Type index_type) {
  if (const auto shared = shared_task(body, index, name)) return *shared;
  const Captures captures = captures_of(body, index);
  const std::vector<Value*> values = *values_of(captures);
  auto* closure_type = llvm::StructType::get(
      e_.context(), ir::mapped(values, [](Value* value) { return value->getType(); }));
  auto* pointer = b_.getPtrTy();
  auto* type = llvm::FunctionType::get(b_.getInt32Ty(), {pointer, b_.getInt32Ty(), pointer}, false);
  const std::string task_name =
      source_.name + "." + what + std::to_string(outlined_.size()) + "." + name;
  auto* function =
      llvm::Function::Create(type, llvm::GlobalValue::InternalLinkage, task_name, e_.module);
  const Outlined task{body, index, captures, aliases_of(captures), closure_type, function};
  outlined_.push_back(task);
  Value* closure = make_closure(closure_type, values, name);
  emit_task(task, index_type);
  return {function, closure};
}

void FunctionGenerator::emit_task(const Outlined& task, Type index_type) {
  const llvm::IRBuilderBase::InsertPointGuard guard(b_);
  Frame outer = std::move(c_.frame);
  c_.frame = {};
  c_.begin(task.function);
  unsigned next = 0;
  const auto next_field = [&] {
    Value* field = b_.CreateStructGEP(task.closure, task.function->getArg(2), next);
    auto* load = b_.CreateLoad(task.closure->getElementType(next++), field);
    load->setMetadata(llvm::LLVMContext::MD_invariant_load, llvm::MDNode::get(e_.context(), {}));
    return load;
  };
  for (const std::string& name : task.captures.variables) c_.frame.variables[name] = next_field();
  for (const std::string& name : task.captures.storages)
    c_.frame.storages[name] = {next_field(), nullptr, outer.storages[name].alias};
  for (const std::string& name : task.captures.blocks) c_.frame.block_names[name] = next_field();
  if (!task.index.empty())
    c_.frame.variables[task.index] =
        b_.CreateIntCast(task.function->getArg(1), llvm_type(e_, index_type), true);
  ++loops_around_;
  statement(task.body);
  --loops_around_;
  c_.finish(b_.getInt32(0));
  c_.frame = std::move(outer);
}

}  // namespace retrograde::codegen
