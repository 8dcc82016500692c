#include "graph/text/declarations.h"

#include "graph/directives/directive_text.h"
#include "ir/build.h"
#include "ir/parse.h"

namespace retrograde::graph {

FuncPtr Declarations::func(const Line& line, const std::string& word) const {
  const auto found = names.funcs.find(unquoted(line, word));
  if (found == names.funcs.end()) fail(line, "a Func of the graph");
  return found->second;
}

Expr Declarations::expr(const Line& line, const FuncPtr& f) const {
  return Binder(names, f, nullptr)(parse_with_names(line.rest, types, names));
}

std::vector<Expr> Declarations::arguments(const Line& line) const {
  std::vector<Expr> args = parse_arguments(line.rest, types);
  for (Expr& arg : args) {
    if (arg.defined()) arg = Binder(names, nullptr, nullptr)(arg);
  }
  return args;
}

int Declarations::integer(const Line& line) const {
  return integer_argument(line, {parse_expr(line.rest, types)}, 0);
}

std::optional<Directive> Declarations::directive(const Line& line, bool of_stage) const {
  std::optional<Directive> directive = parse_directive(line.content);
  if (!directive || is_of_stage(*directive) != of_stage) return std::nullopt;
  Binder(names, nullptr, nullptr)(*directive);
  return directive;
}

int integer_argument(const Line& line, const std::vector<Expr>& args, size_t i) {
  const auto value = i < args.size() && args[i].defined() ? as_const_int(args[i]) : std::nullopt;
  if (!value) fail(line, "an integer");
  return static_cast<int>(*value);
}

}  // namespace retrograde::graph
