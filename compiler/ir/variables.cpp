#include "ir/variables.h"

#include "ir/build.h"
#include "ir/lists.h"

namespace retrograde::ir {

std::vector<Expr> variables_of(const std::vector<std::string>& names) {
  return mapped(names, [](const std::string& name) { return variable(name); });
}

}  // namespace retrograde::ir
