// split_module.h -- one module as several, to be compiled at the same time.
#pragma once

#include <functional>
#include <string>

namespace llvm {
class Module;
}

namespace retrograde::codegen {

// At most one a function.
unsigned possible_parts(const llvm::Module& module, unsigned asked);
// How many parts of this module are worth a thread each: at most `most`, and one for a small
// module or one function among small ones.
unsigned worthwhile_parts(const llvm::Module& module, unsigned most);

// Gives the bitcode of `parts` modules, at most one a function, which together are this one, each as
// soon as it is made. Functions go where the least is, the largest first, so the same module always
// splits in the same way. What was local becomes hidden; local constants are copied to where they
// are used. The module's functions keep their bodies.
using UsePart = std::function<void(unsigned part, std::string bitcode)>;
void split_into_bitcode(llvm::Module& module, unsigned parts, const UsePart& use);

}  // namespace retrograde::codegen
