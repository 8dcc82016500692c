#include "ir/variables.h"

#include "ir/build.h"

namespace retrograde::ir {

std::vector<Expr> variables_of(const std::vector<std::string>& names) {
  std::vector<Expr> result;
  for (const std::string& name : names) result.push_back(variable(name));
  return result;
}

}  // namespace retrograde::ir
