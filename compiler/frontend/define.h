// define.h -- turning what a user writes on the two sides of `=` into definitions, with all checks.
#pragma once

#include <string>
#include <vector>

#include "frontend/function.h"

namespace retrograde::ir {

// f(args) = values as the first definition. `args` must be distinct plain Vars.
void define_pure(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& values);
// f(args) = values as one more update definition.
void define_update(const FuncPtr& f, const std::vector<Expr>& args,
                   const std::vector<Expr>& values);

// The Funcs named in messages: "blur", "blur.update(0)".
std::string stage_name(const FuncContents& f, int stage);

// Calls of `f` inside its own update definitions are weak, so that it does not own itself. A copy
// of a definition for another owner goes through this: `to` takes the place of `from`.
Expr redirect_calls(const Expr& e, const FuncPtr& from, const FuncPtr& to, bool weak);

}  // namespace retrograde::ir
