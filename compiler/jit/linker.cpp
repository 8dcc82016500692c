// Links each object in an execution session of its own, so that functions share nothing and destroying a session
// destroys its function. JITLink's memory manager maps pages writable and then protects them; no page is writable and
// executable at once.
#include "jit/linker.h"

#include <llvm/ExecutionEngine/JITLink/JITLinkMemoryManager.h>
#include <llvm/ExecutionEngine/Orc/Core.h>
#include <llvm/ExecutionEngine/Orc/ExecutorProcessControl.h>
#include <llvm/ExecutionEngine/Orc/ObjectLinkingLayer.h>
#include <llvm/Object/Archive.h>
#include <llvm/Object/ObjectFile.h>
#include <llvm/Support/MemoryBuffer.h>

#include <set>

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

// The object itself, or the members if it is an archive.
std::vector<llvm::MemoryBufferRef> objects_in(llvm::MemoryBufferRef bytes) {
  if (!bytes.getBuffer().starts_with("!<arch>")) return {bytes};
  const auto archive = checked(llvm::object::Archive::create(bytes), "reading an archive");
  std::vector<llvm::MemoryBufferRef> objects;
  llvm::Error problem = llvm::Error::success();
  for (const llvm::object::Archive::Child& member : archive->children(problem))
    objects.push_back(checked(member.getMemoryBufferRef(), "reading an archive"));
  checked(std::move(problem), "reading an archive");
  return objects;
}

struct Symbols {
  std::set<std::string> defined, undefined;
};

void add_symbols(llvm::MemoryBufferRef buffer, Symbols& symbols) {
  const auto object =
      checked(llvm::object::ObjectFile::createObjectFile(buffer), "reading an object file");
  for (const llvm::object::SymbolRef& symbol : object->symbols()) {
    const uint32_t flags = checked(symbol.getFlags(), "reading a symbol");
    const std::string name = checked(symbol.getName(), "reading a symbol").str();
    if (name.empty()) continue;
    const bool is_undefined = flags & llvm::object::SymbolRef::SF_Undefined;
    (is_undefined ? symbols.undefined : symbols.defined).insert(name);
  }
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
    const std::vector<llvm::MemoryBufferRef> parts = objects_in({bytes, name});
    Symbols symbols;
    for (const llvm::MemoryBufferRef& part : parts) add_symbols(part, symbols);
    define_externals(symbols, name, externs);
    for (const llvm::MemoryBufferRef& part : parts) {
      auto copy = llvm::MemoryBuffer::getMemBufferCopy(part.getBuffer(), name);
      checked(layer_.add(library_, std::move(copy)), "linking");
    }
  }

  // Defines the symbols that no part defines.
  void define_externals(const Symbols& symbols, const std::string& name, const Externs& externs) {
    llvm::orc::SymbolMap addresses;
    for (const std::string& symbol : symbols.undefined) {
      if (symbols.defined.count(symbol)) continue;
      addresses[session_.intern(symbol)] = {
          llvm::orc::ExecutorAddr::fromPtr(find_or_throw(symbol, name, externs)),
          llvm::JITSymbolFlags::Exported | llvm::JITSymbolFlags::Callable};
    }
    checked(library_.define(llvm::orc::absoluteSymbols(std::move(addresses))),
            "defining the runtime's symbols");
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
