// extern_argument.h -- what Func::define_extern hands to the C function: Funcs and images as
// buffers, Exprs as scalars.
#pragma once

#include <memory>

#include "frontend/data/buffer.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "graph/function.h"

namespace retrograde {

// Requires: every argument is a defined expression.
struct ExternFuncArgument {
  ExternFuncArgument() = default;
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

  bool defined() const { return defined_; }
  bool is_func() const { return defined_ && contents.kind == graph::ExternArgument::Kind::Func; }
  bool is_expr() const { return defined_ && contents.kind == graph::ExternArgument::Kind::Expr; }
  bool is_buffer() const {
    return defined_ && contents.kind == graph::ExternArgument::Kind::Buffer &&
           contents.buffer->is_literal;
  }
  bool is_image_param() const {
    return defined_ && contents.kind == graph::ExternArgument::Kind::Buffer &&
           !contents.buffer->is_literal;
  }

  graph::ExternArgument contents;

 private:
  bool defined_ = false;
};

}  // namespace retrograde
