// extern_stage -- a Func that a C function computes.
//
//   f.define_extern("fill", {g, k}, Int(32), {x})      let query = fill(&g_query, k, &f_query)
//                                                  =>  let g.min = g_query.min ...
//                                                      produce g; consume g { produce f {
//                                                        assert(fill(&g_buffer, k, &f_buffer) == 0)
//                                                      } }
//
// The function is called twice: first with buffers without memory, when bounds are inferred; it
// then writes into those of its inputs what it needs of them to fill the output's region. Images
// are handed over as they are, also while the caller itself asks for bounds.
//
// Method: descriptors are packed values (Op::pack) in the layout of halide_buffer_t. What was asked
//         for is an expression that contains the call, so that it can stand wherever a bound does.
// Errors: arguments that are inlined or folded; C++ names.
// Source: Halide's documentation of define_extern. Tests: test/unit/extern_stage_test.cpp.
#pragma once

#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"
#include "lower/program.h"

namespace retrograde::lower {

struct ExternStage {
  Stmt call;
  std::vector<std::pair<std::string, Expr>> bindings;  // to be bound around it, in this order
  Requirements uses;                                   // in terms of the bindings
};

// A halide_buffer_t on the stack. `host`: of the element at the region's minima.
Expr packed_buffer(Type type, const Expr& host, const std::vector<Range>& region,
                   const std::vector<Expr>& strides);

// `region`: what is to be computed, by the Func's args.
ExternStage emit_extern_stage(const Program& program, const LoopedFunc& f, const Domain& region);

}  // namespace retrograde::lower
