// own_reads.h -- calls of one Func in expressions, and an update's reads of its own Func: what race
// checks, proofs, regions and derivatives of f(i) = f(i) op e start from.
#pragma once

#include <vector>

#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::graph {

bool is_call_of(const Call& call, const Symbol* f);
// The call of the Func that `e` is; null when it is none.
const Call* as_call_of(const Expr& e, const Symbol* f);
// Calls of Funcs become what `read` makes of them and of their arguments, mapped before; where it
// gives nothing they stay.
using MapCall = FunctionRef<Expr(const Call&, const std::vector<Expr>& args)>;
Expr map_func_calls(const Expr& e, MapCall read);
// The same of one Func.
Expr map_calls_of(const Expr& e, const Symbol* f, MapCall read);
bool same_args(const std::vector<Expr>& a, const std::vector<Expr>& b);

// Each node of a definition once, parents first.
void walk_definition(const Definition& definition, FunctionRef<void(const Expr&)> visit);

// Reads by an update of its own Func, each node once.
std::vector<Expr> own_reads(const FuncContents& f, const Definition& update);
// The first of them that is not of the element written; undefined when there is none.
Expr read_elsewhere(const FuncContents& f, const Definition& update);
// Whether argument d of the definition is the Func's own variable of that dimension.
bool is_pure_position(const FuncContents& f, const Definition& definition, size_t d);
// Whether `e` is the old value of the element written: its value number k, or (-1) any.
bool is_old_value(const Expr& e, const FuncContents& f, const Definition& update, int k = -1);

}  // namespace retrograde::graph
