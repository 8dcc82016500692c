// bounds_query.h -- answers bounds queries: a buffer without memory receives the region that a call would need.
#pragma once

#include "analysis/interval.h"
#include "lower/checks/shape_facts.h"

namespace retrograde::lower {

// Whether the buffer that is passed is a query.
Expr asks_for_bounds(const LoweredArgument& arg);

// Answers a query with the required region, except where the user promised the shape. A promise that mentions the buffer
// itself refers to the required region. Strides are those of a dense buffer.
Stmt answer_query(const LoweredArgument& arg, const Box& required, const ShapeFacts& facts);

}  // namespace retrograde::lower
