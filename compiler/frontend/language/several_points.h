// several_points.h -- f(scatter(a, b)) = gather(u, v): several points in one update definition.
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::frontend {

// Whether scatter() or gather() stands in one of them.
bool names_several_points(const std::vector<Expr>& exprs);

// The update f(args) = values; scatter() is among args.
void define_several_points(const FuncPtr& f, const std::vector<Expr>& args,
                           const std::vector<Expr>& values);

}  // namespace retrograde::frontend
