// split_module.h -- one module as several, to be compiled at the same time.
#pragma once

#include <string>
#include <vector>

namespace llvm {
class Module;
}

namespace retrograde::codegen {

// How many parts of this module are worth a thread each: at most `most`, and one for a small
// module.
unsigned worthwhile_parts(const llvm::Module& module, unsigned most);

// The bitcode of `parts` modules, at most one a function, which together are this one. Functions go
// where the least is, the largest first, so the same module always splits in the same way. What was
// local becomes hidden; local constants are copied to where they are used. The module's functions
// keep their bodies.
std::vector<std::string> split_into_bitcode(llvm::Module& module, unsigned parts);

}  // namespace retrograde::codegen
