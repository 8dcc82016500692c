// Packs object files into an archive: for static libraries, and for a program's parts that the JIT links.
#pragma once

#include <string>
#include <vector>

namespace retrograde::codegen {

struct Member {
  std::string name, contents;  // an object file
};
// Builds an archive with a symbol index. The same members always give the same bytes.
std::string archive(const std::vector<Member>& members);

}  // namespace retrograde::codegen
