// extern_stage -- a Func that a C function computes.
//
//   f.define_extern("fill", {g, k}, Int(32), {x})      let query = fill(&g_query, k, &f_query)
//                                                  =>  let g.min = g_query.min ...
//                                                      produce g; consume g { produce f {
//                                                        assert(fill(&g_buffer, k, &f_buffer) == 0)
//                                                      } }
//
// The function is called several times: when bounds are inferred with buffers without memory, first
// for how large it makes its output, then for what it needs of its inputs to fill that; at last to
// fill it. An output of the pipeline has the size that its caller gives. Images are asked for in the
// same way; where there is one, the function is handed it as it is. What the function reads or
// writes is stored where it is computed (inline_functions sees to it).
//
// Inside of a loop it is asked in each iteration for its part, and once outside of all loops for the
// whole (ask_for_whole): code further out knows nothing else. A function that asks for more in a
// part than for the whole is stopped by a check. One that rounds its output up may reach further
// from the last point than from the whole, so the first and the last point are asked for, too.
//
// Method: descriptors are packed values (Op::pack) in the layout of halide_buffer_t. What was asked
//         for is an expression that contains the call, so that it can stand wherever a bound does.
// Errors: arguments that are inlined or folded; C++ names.
// Source: Halide's documentation of define_extern. Tests: test/unit/extern_stage_test.cpp.
#pragma once

#include "ir/build.h"
#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"
#include "lower/program.h"

namespace retrograde::lower {

// What the function says to a region: in terms of names that are to be bound, in this order.
struct ExternAnswer {
  Lets bindings;
  Box computed;       // no less than the region
  Requirements uses;  // of Funcs and images
};

struct ExternStage {
  Stmt call;
  Lets bindings;
  Box computed;
  Requirements uses;
  std::vector<Stmt> checks;
  // In loops: names that stand for ends of what one iteration uses, and all that they cover in the
  // end, in terms of names that ask_for_whole binds.
  std::vector<std::pair<std::string, Interval>> parts;
};

// What a stage inside of loops computes in the end is noted in the uses under this name.
std::string whole_region_of(const LoopedFunc& f);
// At root.
ExternAnswer ask_for_whole(const LoopedFunc& f, const Box& region);

// A halide_buffer_t on the stack. `host`: of the element at the region's minima.
Expr packed_buffer(Type type, const Expr& host, const std::vector<Range>& region,
                   const std::vector<Expr>& strides);

struct ExternCall {
  Box region;  // what is to be computed
  bool in_loops;
  bool is_slice;  // of storage that is made for the whole: it computes its region and no more
};
ExternStage emit_extern_stage(const Program& program, const LoopedFunc& f, const ExternCall& call);

}  // namespace retrograde::lower
