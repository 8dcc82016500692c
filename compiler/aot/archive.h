// Static libraries.
#pragma once

#include <string>
#include <vector>

namespace retrograde::aot {

struct Member {
  std::string name, contents;  // an object file
};
// An archive with an index of symbols. Same members, same bytes.
std::string archive(const std::vector<Member>& members);

}  // namespace retrograde::aot
