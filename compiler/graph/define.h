// define.h -- turning what a user writes on the two sides of `=` into definitions, with all checks.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

// f(args) = values as the first definition. `args` must be distinct plain Vars.
void define_pure(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& values);
// f(args) = values as one more update definition, over `domain` or, where it is null, over that of
// the reduction variables that the two sides mention.
void define_update(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& values,
                   const DomainPtr& domain = nullptr);

// f's values come from a C function; `asked` for messages.
void define_extern(const FuncPtr& f, ExternDefinition definition, const std::vector<Type>& types,
                   const std::vector<std::string>& variables, const std::string& asked);
// The buffers that stand for f when it is an output, unless it has them; once its args and types are known,
// or those that it was declared with.
void make_outputs(FuncContents& f);

// CompileError unless `e` has one value in a call: made of parameters, facts of buffers, constants
// and operators.  `what` names it in the message: "the condition".
void check_over_parameters(const Expr& e, const char* what, const std::string& asked);

// "blur.cpp:12"
std::string source_location_of(const FuncContents& f);

// The Funcs named in messages: "blur", "blur.update(0)".
std::string stage_name(const FuncContents& f, int stage);

// Calls of `f` inside its own update definitions are weak, so that it does not own itself. A copy
// of a definition for another owner goes through this: `to` takes the place of `from`.
Expr redirect_calls(const Expr& e, const FuncPtr& from, const FuncPtr& to, bool weak);

}  // namespace retrograde::graph
