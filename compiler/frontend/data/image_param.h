// image_param.h -- buffers that a compiled pipeline takes as arguments, and promises about their shape.
#pragma once

#include <concepts>
#include <memory>
#include <string>
#include <vector>

#include "frontend/data/argument.h"
#include "frontend/data/buffer.h"
#include "frontend/language/rdom.h"

namespace retrograde {

class Func;

// Min, extent and stride of one dimension as Exprs, and promises about them. For example, set_min(0) and
// set_stride(3) let the compiler rely on these values; a call with a buffer that breaks a promise fails.
// Requires: a dimension is numbered from 0.
class Dimension {
 public:
  // Dimension `d` of an image parameter.
  Dimension(std::shared_ptr<graph::ParameterContents> parameter, int d);
  Expr min() const;                                  // first coordinate of the bound buffer
  Expr extent() const;                               // number of elements along the dimension
  Expr max() const { return min() + extent() - 1; }  // last coordinate
  Expr stride() const;                               // distance in memory, in elements
  // Promises the first coordinate.
  // Requires: sizes and strides are integers; a promise has one value in each call: it is made of
  // parameters and facts about buffers.
  Dimension& set_min(Expr min);
  // Promises the number of elements.
  // Requires: an extent is not negative.
  Dimension& set_extent(Expr extent);
  // Promises the stride, in elements; an undefined Expr allows any stride.
  Dimension& set_stride(Expr stride);
  // Promises both min and extent.
  Dimension& set_bounds(Expr min, Expr extent);
  // States a likely min and extent for schedulers; calls may differ.
  Dimension& set_estimate(Expr min, Expr extent);
  // The same as set_estimate, under Halide's other name.
  Dimension& set_bounds_estimate(Expr min, Expr extent) {
    return set_estimate(std::move(min), std::move(extent));
  }
  Expr min_estimate() const { return constraint().min_estimate; }  // estimated min, or undefined
  // Estimated extent, or undefined.
  Expr extent_estimate() const { return constraint().extent_estimate; }
  // Dimension `d` of the same parameter, for chained calls.
  Dimension dim(int d) const { return Dimension(parameter_, d); }

 private:
  graph::BufferConstraint& constraint() const { return parameter_->constraints[d_]; }
  void set(Expr graph::BufferConstraint::*field, Expr value, const char* which);
  std::shared_ptr<graph::ParameterContents> parameter_;
  int d_;
};

// A buffer that a compiled pipeline takes as an argument: the common base of inputs (ImageParam) and outputs
// (Func::output_buffer()).
// Requires: it needs a type and dimensions.
class OutputImageParam {
 public:
  OutputImageParam() = default;  // an undefined handle
  // A handle to an existing parameter.
  explicit OutputImageParam(std::shared_ptr<graph::ParameterContents> parameter)
      : parameter_(std::move(parameter)) {}
  bool defined() const { return parameter_ != nullptr; }      // whether there is a parameter
  const std::string& name() const { return checked().name; }  // name in messages and generated code
  Type type() const { return checked().type; }                // type of the elements
  int dimensions() const { return checked().dimensions; }     // number of dimensions
  Dimension dim(int i) const;                                 // bounds and promises of dimension i
  Expr left() const { return dim(0).min(); }                  // first coordinate of dimension 0
  Expr right() const { return dim(0).max(); }                 // last coordinate of dimension 0
  Expr top() const { return dim(1).min(); }                   // first coordinate of dimension 1
  Expr bottom() const { return dim(1).max(); }                // last coordinate of dimension 1
  Expr width() const { return dim(0).extent(); }              // extent of dimension 0
  Expr height() const { return dim(1).extent(); }             // extent of dimension 1
  Expr channels() const { return dim(2).extent(); }           // extent of dimension 2
  // States a likely (min, extent) of every dimension for schedulers.
  // Requires: there is one for each dimension.
  OutputImageParam& set_estimates(const Region& estimates);
  // Promises that the buffer's address is a multiple of `bytes`.
  // Requires: it is a power of two of at least the elements' bytes.
  OutputImageParam& set_host_alignment(int bytes);
  int host_alignment() const;  // promised alignment in bytes, at least the element size
  // Accepts MemoryType::Auto and MemoryType::Heap; other memories cannot hold an argument.
  // Requires: argument buffers lie in the memory of the CPU (Unsupported).
  OutputImageParam& store_in(MemoryType memory);
  // Describes the parameter as an argument of an ahead-of-time function.
  operator Argument() const { return frontend::argument_of(checked()); }
  // The record behind the handle.
  const std::shared_ptr<graph::ParameterContents>& parameter() const { return parameter_; }

 protected:
  graph::ParameterContents& checked() const;
  std::shared_ptr<graph::ParameterContents> parameter_;
};

namespace frontend {
// Throws CompileError if the buffer's type or rank differs from the parameter's.
void check_image(const ParameterContents& parameter, const Buffer<>& buffer);
void check_estimates(const std::string& name, int dimensions, const Region& estimates);
}  // namespace frontend

// An input image: a buffer that the pipeline reads and that is bound before each call.
class ImageParam : public OutputImageParam {
 public:
  ImageParam() = default;  // an undefined handle
  // An input of the given element type and rank, with a generated name unless one is given.
  // Requires: its elements are numbers or pointers; dimensions are not negative.
  ImageParam(Type type, int dimensions);
  ImageParam(Type type, int dimensions, const std::string& name);
  ImageParam(Type type, int dimensions, std::nullptr_t) = delete;

  // A handle to an existing parameter.
  explicit ImageParam(std::shared_ptr<graph::ParameterContents> parameter)
      : OutputImageParam(std::move(parameter)) {}

  // Binds the buffer that the next calls read.
  // Requires: the buffer's elements are of the parameter's type; the buffer has as many dimensions
  // as the parameter.
  void set(const Buffer<>& buffer);
  Buffer<> get() const;  // the buffer that is bound, or an undefined handle
  void reset();          // unbinds the buffer
  // Promises that no element is infinite or NaN in any call. Gradients then multiply adjoints by elements
  // with plain products, which fuse with sums, instead of products that map a zero adjoint to zero. If the
  // promise is broken, such gradients are NaN instead of 0. Affects derivatives that are built afterwards.
  ImageParam& promise_finite();

  // The element at a point, as an Expr.
  template <std::convertible_to<Expr>... Args>
  Expr operator()(Args&&... args) const {
    return access({Expr(std::forward<Args>(args))...});
  }
  Expr operator()(const std::vector<Expr>& args) const { return access(args); }
  // The constraint excludes braced lists such as {x, 0}, whose elements are Exprs.
  template <std::same_as<Var> V>
  Expr operator()(const std::vector<V>& args) const {
    return access(std::vector<Expr>(args.begin(), args.end()));
  }
  // The Func that reads this image point by point; every conversion gives the same Func. Its directives, such
  // as compute_root, apply to every access to the image.
  operator Func() const;
  // Wrappers of the image's Func, as in Func::in.
  //   f(x) = im(x) + im(x + 1)    =>    im_im_in_f(x) = im(x)
  //                                     f(x) = im_im_in_f(x) + im_im_in_f(x + 1)
  Func in(const Func& f);
  Func in(const std::vector<Func>& fs);
  Func in();
  // Reports each load from the image to the trace handler.
  void trace_loads();
  // Adds a tag that trace events of this image carry.
  ImageParam& add_trace_tag(const std::string& tag);

 private:
  Expr access(const std::vector<Expr>& args) const;
};

}  // namespace retrograde
