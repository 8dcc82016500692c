// The passes from statement to statement, by name: for tools/opt and the golden tests.
// (pipeline.cpp is the order in which the compiler runs them.)
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

struct StatementPass {
  const char* name;
  Stmt (*run)(const Stmt&);
};
const std::vector<StatementPass>& statement_passes();
const StatementPass* find_statement_pass(const std::string& name);  // null when there is none

}  // namespace retrograde::ir
