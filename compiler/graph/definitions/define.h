// define.h -- turns the two sides of a user's `=` into a checked definition.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

// Adds f(args) = values as the pure definition. `args` must be distinct plain Vars.
void define_pure(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& values);
// Adds f(args) = values as another update definition over `domain`. If that is null, the domain is
// the one of the reduction variables that the two sides mention.
void define_update(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& values,
                   const DomainPtr& domain = nullptr);

// Defines f by a C function; messages quote `asked`.
void define_extern(const FuncPtr& f, ExternDefinition definition, const std::vector<Type>& types,
                   const std::vector<std::string>& variables, const std::string& asked);
// Creates the buffers that represent f as an output, unless it has them. Takes f's args and types,
// or those of its declaration while f is undefined.
void make_outputs(FuncContents& f);

// "blur.cpp:12"
std::string source_location_of(const FuncContents& f);

// The name of a stage in messages: "blur", "blur.update(0)".
std::string stage_name(const FuncContents& f, int stage);

// Redirects the calls of `from` in `e` to `to`; a copied definition gets its new owner this way.
// Calls of a Func inside its own updates are weak, so that it does not own itself.
Expr redirect_calls(const Expr& e, const FuncPtr& from, const FuncPtr& to, bool weak);

}  // namespace retrograde::graph
