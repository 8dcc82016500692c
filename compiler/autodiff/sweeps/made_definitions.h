// Definitions of the Funcs that differentiation makes, and reads of them.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

// A call of value `index` of f.
Expr call_value(const FuncPtr& f, const std::vector<Expr>& args, int index);
// Calls of all its values.
std::vector<Expr> values_of(const FuncPtr& f, const std::vector<Expr>& args);

// f(args) <- values over the reduction variables, where predicate. As an update written by a user,
// but the domain need not be mentioned. Calls of `f` in it become weak.
void append_update(const FuncPtr& f, std::vector<Expr> args, std::vector<Expr> values,
                   const std::vector<ReductionVariable>& rvars, Expr predicate);
// f(args) += terms, each in the type of the value that it is added to; undefined ones add nothing.
void append_sums(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& terms,
                 const std::vector<ReductionVariable>& rvars, const Expr& predicate);

// What `values` do to adjoints concerns all that f passes on.
void note_traits(const FuncPtr& f, const std::vector<Expr>& values);

}  // namespace retrograde::autodiff
