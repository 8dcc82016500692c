// extern_stage -- build the code of a Func that a C function computes (define_extern).
//
//   f.define_extern("fill", {g, k}, Int(32), {x})      let query = fill(&g_query, k, &f_query)
//                                                  =>  let g.min = g_query.min ...
//                                                      produce g; consume g { produce f {
//                                                        assert(fill(&g_buffer, k, &f_buffer) == 0)
//                                                      } }
//
// The function is called several times. For bounds inference it gets buffers without memory: first it answers how large
// its output will be, then which regions of its inputs it needs for that. The last call fills the output. An output of
// the pipeline has the size of the caller's buffer. Images are queried in the same way, but an existing image is
// passed unchanged. Funcs that the function reads or writes are stored where they are computed (inline_functions
// ensures this).
//
// Inside of a loop the function is queried in each iteration for its part, and once outside of all loops for the
// complete region (ask_for_whole), which code further out uses. A run-time check fails if a part needs more than the
// complete region. A function that rounds up its output may reach further for the last point than for the complete
// region, so the first and the last point are queried as well.
//
// Method: buffer descriptors are packed values (Op::pack) in the layout of halide_buffer_t. The answer to a query is an
//         expression that contains the call, so that it can be used wherever a bound can.
// Errors: arguments that are inlined or folded; functions with C++ names.
// Source: Halide's documentation of define_extern. Tests: test/unit/lower/extern_stage_test.cpp.
#pragma once

#include "ir/build.h"
#include "lower/nests/build_loop_nests.h"
#include "lower/nests/stage_nest.h"
#include "lower/program.h"

namespace retrograde::lower {

// The function's answer to a query for a region, in terms of names that are to be bound in this order.
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
  // In loops: names of ends of the regions that one iteration uses, and the intervals that these cover in the end, in
  // terms of names that ask_for_whole binds.
  std::vector<std::pair<std::string, Interval>> parts;
};

// The name under which `uses` holds the complete region of a stage inside of loops.
std::string whole_region_of(const LoopedFunc& f);
// Queries the function for the complete region, at root.
ExternAnswer ask_for_whole(const LoopedFunc& f, const Box& region);

// A halide_buffer_t on the stack. `host`: the address of the element at the region's minima.
Expr packed_buffer(Type type, const Expr& host, const std::vector<Range>& region,
                   const std::vector<Expr>& strides);

struct ExternCall {
  Box region;  // to be computed
  bool in_loops;
  bool
      is_slice;  // of storage allocated for the complete region: the call computes exactly its region
};
ExternStage emit_extern_stage(const Program& program, const LoopedFunc& f, const ExternCall& call);

}  // namespace retrograde::lower
