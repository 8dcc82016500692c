// generated_definitions.h -- helpers to define the Funcs that differentiation generates, and to read them.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

// A call of value `index` of f.
Expr call_value(const FuncPtr& f, const std::vector<Expr>& args, int index);
// Calls of all values of f.
std::vector<Expr> values_of(const FuncPtr& f, const std::vector<Expr>& args);

// Adds the update f(args) <- values over the reduction variables, where the predicate holds. It equals an update
// written by a user, except that the domain need not occur in it. Its calls of `f` become weak references.
void append_update(const FuncPtr& f, std::vector<Expr> args, std::vector<Expr> values,
                   const std::vector<ReductionVariable>& rvars, Expr predicate);
// Adds the update f(args) += terms. Each term is cast to the type of its value; undefined terms add nothing.
void append_sums(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& terms,
                 const std::vector<ReductionVariable>& rvars, const Expr& predicate);

// Records the traits of `values` for f, and for every adjoint computed from f.
void note_traits(const FuncPtr& f, const std::vector<Expr>& values);

}  // namespace retrograde::autodiff
