// split_module.h -- splits a module into several, which are compiled in parallel.
#pragma once

#include <functional>
#include <string>

namespace llvm {
class Module;
}

namespace retrograde::codegen {

// At most one part per function.
unsigned possible_parts(const llvm::Module& module, unsigned asked);
// Number of parts of this module that are worth a thread each, at most `most`. It is one for a small module, and for a
// module with only one large function.
unsigned worthwhile_parts(const llvm::Module& module, unsigned most);

// Splits the module into `parts` modules, at most one per function, and passes the bitcode of each to `use` as soon as
// it is ready. The largest function goes first, each to the smallest part so far, so the same module always splits in
// the same way. Local symbols become hidden; local constants are copied to their users. The module keeps its function
// bodies.
using UsePart = std::function<void(unsigned part, std::string bitcode)>;
void split_into_bitcode(llvm::Module& module, unsigned parts, const UsePart& use);

}  // namespace retrograde::codegen
