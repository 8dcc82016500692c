// declarations.h -- the entities that the text of a graph declares, and values in lines that mention
// them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/text/binder.h"
#include "graph/text/graph_lines.h"

namespace retrograde::graph {

struct Declarations {
  NamedEntities names;
  NameTypes types;

  FuncPtr func(const Line& line, const std::string& word) const;
  // The line without its first word as an expression in a definition of `f`; null: outside of Funcs.
  Expr expr(const Line& line, const FuncPtr& f) const;
  // The line as a list of expressions outside of Funcs, undefined where it says _.
  std::vector<Expr> arguments(const Line& line) const;
  int integer(const Line& line) const;
  // The line as a directive of a stage, or of a Func, as requested; nothing if it is another line.
  std::optional<Directive> directive(const Line& line, bool of_stage) const;
};

// The i-th argument of a line as an integer.
int integer_argument(const Line& line, const std::vector<Expr>& args, size_t i);

}  // namespace retrograde::graph
