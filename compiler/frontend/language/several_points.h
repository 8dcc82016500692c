// several_points.h -- update definitions that store to several points: f(scatter(a, b)) = gather(u, v).
#pragma once

#include <vector>

#include "graph/function.h"

namespace retrograde::frontend {

// Whether one of the expressions contains scatter() or gather().
bool names_several_points(const std::vector<Expr>& exprs);

// Adds the update f(args) = values, whose args contain scatter().
void define_several_points(const FuncPtr& f, const std::vector<Expr>& args,
                           const std::vector<Expr>& values);

}  // namespace retrograde::frontend
