// One execution session an object: nothing is shared between functions, and destroying a function
// is destroying its session. JITLink's memory manager maps pages for writing, then protects them;
// no page is ever both.
#include "jit/linker.h"

#include <llvm/ExecutionEngine/JITLink/JITLinkMemoryManager.h>
#include <llvm/ExecutionEngine/Orc/Core.h>
#include <llvm/ExecutionEngine/Orc/ExecutorProcessControl.h>
#include <llvm/ExecutionEngine/Orc/ObjectLinkingLayer.h>
#include <llvm/Object/ObjectFile.h>
#include <llvm/Support/MemoryBuffer.h>

#include "diagnostics/error.h"
#include "jit/symbols.h"

namespace retrograde::jit {
namespace {

template <typename T>
T checked(llvm::Expected<T> value, const char* what) {
  if (!value) internal_error(std::string(what) + ": " + llvm::toString(value.takeError()));
  return std::move(*value);
}

void checked(llvm::Error error, const char* what) {
  if (error) internal_error(std::string(what) + ": " + llvm::toString(std::move(error)));
}

std::vector<std::string> undefined_symbols(llvm::MemoryBufferRef buffer) {
  const auto object =
      checked(llvm::object::ObjectFile::createObjectFile(buffer), "reading an object file");
  std::vector<std::string> names;
  for (const llvm::object::SymbolRef& symbol : object->symbols()) {
    const uint32_t flags = checked(symbol.getFlags(), "reading a symbol");
    if (!(flags & llvm::object::SymbolRef::SF_Undefined)) continue;
    const std::string name = checked(symbol.getName(), "reading a symbol").str();
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

void* find_or_throw(const std::string& name, const std::string& function, const Externs& externs) {
  const auto given = externs.find(name);
  void* address = given == externs.end() ? find_symbol(name) : given->second;
  if (!address) {
    user_error("compile \"" + function + "\"",
               "a C function that it calls must be in this process, or among its JIT externs",
               "it calls \"" + name + "\"",
               "Export the function (HALIDE_EXPORT_SYMBOL), or name it in set_jit_externs");
  }
  return address;
}

class Linked : public LinkedObject {
 public:
  Linked(const std::vector<uint8_t>& object, const std::string& name, const Externs& externs)
      : session_(checked(llvm::orc::SelfExecutorProcessControl::Create(), "starting the linker")),
        memory_(llvm::jitlink::InProcessMemoryManager::Create()),
        layer_(session_, *checked_memory()),
        library_(session_.createBareJITDylib(name)) {
    session_.setErrorReporter(
        [this](llvm::Error error) { problem_ += llvm::toString(std::move(error)) + "; "; });
    try {
      add(object, name, externs);
    } catch (...) {
      close();
      throw;
    }
  }
  ~Linked() override { close(); }

  void* find(const std::string& name) const override {
    auto symbol = session_.lookup({&library_}, session_.intern(name));
    if (!symbol) {
      internal_error("linking " + name + ": " + llvm::toString(symbol.takeError()) + "; " +
                     problem_);
    }
    return symbol->getAddress().toPtr<void*>();
  }

 private:
  llvm::jitlink::JITLinkMemoryManager* checked_memory() {
    if (!memory_) internal_error("mapping memory for code: " + llvm::toString(memory_.takeError()));
    return memory_->get();
  }

  void add(const std::vector<uint8_t>& object, const std::string& name, const Externs& externs) {
    const llvm::StringRef bytes(reinterpret_cast<const char*>(object.data()), object.size());
    auto buffer = llvm::MemoryBuffer::getMemBufferCopy(bytes, name);
    llvm::orc::SymbolMap symbols;
    for (const std::string& symbol : undefined_symbols(buffer->getMemBufferRef())) {
      symbols[session_.intern(symbol)] = {
          llvm::orc::ExecutorAddr::fromPtr(find_or_throw(symbol, name, externs)),
          llvm::JITSymbolFlags::Exported | llvm::JITSymbolFlags::Callable};
    }
    checked(library_.define(llvm::orc::absoluteSymbols(std::move(symbols))),
            "defining the runtime's symbols");
    checked(layer_.add(library_, std::move(buffer)), "linking");
  }

  void close() { llvm::consumeError(session_.endSession()); }

  mutable llvm::orc::ExecutionSession session_;
  llvm::Expected<std::unique_ptr<llvm::jitlink::InProcessMemoryManager>> memory_;
  llvm::orc::ObjectLinkingLayer layer_;
  llvm::orc::JITDylib& library_;
  std::string problem_;
};

}  // namespace

std::unique_ptr<LinkedObject> link(const std::vector<uint8_t>& object, const std::string& name,
                                   const Externs& externs) {
  return std::make_unique<Linked>(object, name, externs);
}

}  // namespace retrograde::jit
