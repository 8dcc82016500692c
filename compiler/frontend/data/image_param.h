// image_param.h -- buffers that a compiled pipeline takes as arguments, and what is known about
// their shape.
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

// Facts of one dimension as Exprs, and promises about it: set_min(0), set_stride(3). A call with a
// buffer that breaks a promise fails.
// Requires: a dimension is numbered from 0.
class Dimension {
 public:
  Dimension(std::shared_ptr<graph::ParameterContents> parameter, int d);
  Expr min() const;
  Expr extent() const;
  Expr max() const { return min() + extent() - 1; }
  Expr stride() const;
  // Requires: sizes and strides are integers; a promise has one value in each call: it is made of
  // parameters and facts about buffers.
  Dimension& set_min(Expr min);
  // Requires: an extent is not negative.
  Dimension& set_extent(Expr extent);
  Dimension& set_stride(Expr stride);
  Dimension& set_bounds(Expr min, Expr extent);
  Dimension& set_estimate(Expr min, Expr extent);
  Dimension& set_bounds_estimate(Expr min, Expr extent) {
    return set_estimate(std::move(min), std::move(extent));
  }
  Expr min_estimate() const { return constraint().min_estimate; }
  Expr extent_estimate() const { return constraint().extent_estimate; }
  Dimension dim(int d) const { return Dimension(parameter_, d); }

 private:
  graph::BufferConstraint& constraint() const { return parameter_->constraints[d_]; }
  Expr fact(const char* which) const;
  void set(Expr graph::BufferConstraint::*field, Expr value, const char* which);
  std::shared_ptr<graph::ParameterContents> parameter_;
  int d_;
};

// What inputs and outputs have in common. For outputs: Func::output_buffer().
// Requires: it needs a type and dimensions.
class OutputImageParam {
 public:
  OutputImageParam() = default;
  explicit OutputImageParam(std::shared_ptr<graph::ParameterContents> parameter)
      : parameter_(std::move(parameter)) {}
  bool defined() const { return parameter_ != nullptr; }
  const std::string& name() const { return checked().name; }
  Type type() const { return checked().type; }  // of its elements
  int dimensions() const { return checked().dimensions; }
  Dimension dim(int i) const;  // facts and promises of one dimension
  Expr left() const { return dim(0).min(); }
  Expr right() const { return dim(0).max(); }
  Expr top() const { return dim(1).min(); }
  Expr bottom() const { return dim(1).max(); }
  Expr width() const { return dim(0).extent(); }
  Expr height() const { return dim(1).extent(); }
  Expr channels() const { return dim(2).extent(); }
  // Requires: there is one for each dimension.
  OutputImageParam& set_estimates(const Region& estimates);
  // A promise about the address of the buffer, in bytes: a power of two, at least the elements'
  // size.
  // Requires: it is a power of two of at least the elements' bytes.
  OutputImageParam& set_host_alignment(int bytes);
  int host_alignment() const;
  // Requires: buffers of arguments are memory of the CPU (Unsupported).
  OutputImageParam& store_in(MemoryType memory);
  operator Argument() const { return frontend::argument_of(checked()); }
  const std::shared_ptr<graph::ParameterContents>& parameter() const { return parameter_; }

 protected:
  graph::ParameterContents& checked() const;
  std::shared_ptr<graph::ParameterContents> parameter_;
};

namespace frontend {
// CompileError when the buffer's type or dimensions are not the parameter's.
void check_image(const ParameterContents& parameter, const Buffer<>& buffer);
void check_estimates(const std::string& name, int dimensions, const Region& estimates);
}  // namespace frontend

class ImageParam : public OutputImageParam {
 public:
  ImageParam() = default;
  // Requires: its elements are numbers or pointers; dimensions are not negative.
  ImageParam(Type type, int dimensions);
  ImageParam(Type type, int dimensions, const std::string& name);
  ImageParam(Type type, int dimensions, std::nullptr_t) = delete;

  explicit ImageParam(std::shared_ptr<graph::ParameterContents> parameter)
      : OutputImageParam(std::move(parameter)) {}

  // The buffer of the next calls.
  // Requires: the buffer's elements are of the parameter's type; the buffer has as many dimensions
  // as the parameter.
  void set(const Buffer<>& buffer);
  Buffer<> get() const;
  void reset();  // no buffer for the next calls
  // A promise that no element is infinite or NaN in any call. Products with adjoints that may be 0
  // are then plain ones, which fuse with sums; where it is broken, gradients are NaN where they would
  // be 0. Affects what is differentiated after it.
  ImageParam& promise_finite();

  template <std::convertible_to<Expr>... Args>
  Expr operator()(Args&&... args) const {
    return access({Expr(std::forward<Args>(args))...});
  }
  Expr operator()(const std::vector<Expr>& args) const { return access(args); }
  // Not of braces, whose elements are Exprs: {x, 0}.
  template <std::same_as<Var> V>
  Expr operator()(const std::vector<V>& args) const {
    return access(std::vector<Expr>(args.begin(), args.end()));
  }
  // The Func that reads this image point by point: the same each time. What is said of it, such as
  // compute_root, holds for every access to the image.
  operator Func() const;
  // Wrappers of that Func: see Func::in.
  //   f(x) = im(x) + im(x + 1)    =>    im_im_in_f(x) = im(x)
  //                                     f(x) = im_im_in_f(x) + im_im_in_f(x + 1)
  Func in(const Func& f);
  Func in(const std::vector<Func>& fs);
  Func in();
  // Each load is reported to the trace handler, with these tags.
  void trace_loads();
  ImageParam& add_trace_tag(const std::string& tag);

 private:
  Expr access(const std::vector<Expr>& args) const;
};

}  // namespace retrograde
