// own_reads.h -- finds calls of one Func in expressions, and the reads that an update makes of its
// own Func. Race checks, associativity proofs, regions and derivatives of f(i) = f(i) op e build on
// these.
#pragma once

#include <vector>

#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::graph {

bool is_call_of(const Call& call, const Symbol* f);
// `e` as a call of the Func; null when it is another expression.
const Call* as_call_of(const Expr& e, const Symbol* f);
// Rewrites the calls of all Funcs by `read`, which takes the call and its rewritten arguments.
// Where `read` returns an undefined expression, the call stays.
using MapCall = FunctionRef<Expr(const Call&, const std::vector<Expr>& args)>;
Expr map_func_calls(const Expr& e, MapCall read);
// Rewrites the calls of one Func.
Expr map_calls_of(const Expr& e, const Symbol* f, MapCall read);
bool same_args(const std::vector<Expr>& a, const std::vector<Expr>& b);

// Visits each node of a definition once, parents first.
void walk_definition(const Definition& definition, FunctionRef<void(const Expr&)> visit);

// The reads of its own Func in an update, each node once.
std::vector<Expr> own_reads(const FuncContents& f, const Definition& update);
// The first own read of another element than the one written; undefined when there is none.
Expr read_elsewhere(const FuncContents& f, const Definition& update);
// Whether argument d of the definition is the Func's own variable of that dimension.
bool is_pure_position(const FuncContents& f, const Definition& definition, size_t d);
// Whether `e` is the old value of the element written: its Tuple value k, or any (-1).
bool is_old_value(const Expr& e, const FuncContents& f, const Definition& update, int k = -1);

}  // namespace retrograde::graph
