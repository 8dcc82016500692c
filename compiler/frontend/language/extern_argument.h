// extern_argument.h -- arguments that Func::define_extern passes to the C function.
#pragma once

#include <memory>

#include "frontend/data/buffer.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "graph/function.h"

namespace retrograde {

// One argument of an extern stage. Funcs and images are passed as halide_buffer_t*, Exprs as scalars.
// Requires: every argument is a defined expression.
struct ExternFuncArgument {
  ExternFuncArgument() = default;  // an undefined argument
  // Converts a Func, an image, an Expr, a Param or a number to an argument.
  ExternFuncArgument(graph::FuncPtr func);
  template <typename T, int Dims>
  ExternFuncArgument(const Buffer<T, Dims>& buffer) : ExternFuncArgument(buffer.parameter()) {}
  ExternFuncArgument(Expr e);
  template <typename T>
  ExternFuncArgument(const Param<T>& param) : ExternFuncArgument(Expr(param)) {}
  ExternFuncArgument(int e) : ExternFuncArgument(Expr(e)) {}
  ExternFuncArgument(float e) : ExternFuncArgument(Expr(e)) {}
  ExternFuncArgument(std::shared_ptr<graph::ParameterContents> image);
  ExternFuncArgument(const OutputImageParam& image) : ExternFuncArgument(image.parameter()) {}

  bool defined() const { return defined_; }  // whether it holds anything
  // Whether it is a Func.
  bool is_func() const { return defined_ && contents.kind == graph::ExternArgument::Kind::Func; }
  // Whether it is a scalar.
  bool is_expr() const { return defined_ && contents.kind == graph::ExternArgument::Kind::Expr; }
  // Whether it is a Buffer that the program names.
  bool is_buffer() const {
    return defined_ && contents.kind == graph::ExternArgument::Kind::Buffer &&
           contents.buffer->is_literal;
  }
  // Whether it is an ImageParam.
  bool is_image_param() const {
    return defined_ && contents.kind == graph::ExternArgument::Kind::Buffer &&
           !contents.buffer->is_literal;
  }

  graph::ExternArgument contents;  // the argument as the graph stores it

 private:
  bool defined_ = false;
};

}  // namespace retrograde
