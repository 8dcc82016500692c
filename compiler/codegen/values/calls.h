// Calls of C functions, and of operators that need more than the values of their arguments.
#pragma once

#include <string>
#include <vector>

#include "codegen/values/values.h"

namespace retrograde::codegen {

Value* called(Values& values, const ir::Call& e);

// ---- runtime_calls.cpp ----
Value* runtime_call(Values& values, const ir::Call& e);
Value* pack(Values& values, const std::vector<Expr>& parts);
Value* prefetch(Values& values, const ir::Call& e);
Value* trace(Values& values, const ir::Call& e);

// ---- messages.cpp: `separator` is printed between parts ----
Value* report_error(Values& values, Value* code, const std::vector<Expr>& parts, size_t first,
                    const std::string& separator);
Value* print_call(Values& values, const ir::Call& e);

// ---- buffers.cpp: halide_buffer_t ----
bool is_buffer_operator(ir::Op op);
Value* buffer_operator(Values& values, const ir::Call& e);
// Null for a null buffer.
Value* host_pointer(FunctionContext& c, Value* buffer);

}  // namespace retrograde::codegen
