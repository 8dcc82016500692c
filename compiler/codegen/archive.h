// Object files together in one: static libraries, and the parts of a program that the JIT links.
#pragma once

#include <string>
#include <vector>

namespace retrograde::codegen {

struct Member {
  std::string name, contents;  // an object file
};
// An archive with an index of symbols. Same members, same bytes.
std::string archive(const std::vector<Member>& members);

}  // namespace retrograde::codegen
