// parameter.h -- a parameter whose kind and type are known at run time only.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "frontend/data/image_param.h"
#include "frontend/data/param.h"

namespace retrograde {

// A handle to a Param or an ImageParam whose kind and type are known at run time only. parameter() of both
// classes converts to it.
class Parameter {
 public:
  Parameter() = default;  // an undefined handle
  // A handle to an existing parameter.
  Parameter(std::shared_ptr<graph::ParameterContents> contents) : contents_(std::move(contents)) {}
  // A new parameter: a scalar of `type`, or a buffer of such elements.
  Parameter(const Type& type, bool is_buffer, int dimensions)
      : Parameter(type, is_buffer, dimensions, "") {}
  // Requires: a scalar has no dimensions.
  Parameter(const Type& type, bool is_buffer, int dimensions, const std::string& name);

  bool defined() const { return contents_ != nullptr; }  // whether there is a parameter
  // Whether both handles refer to one parameter.
  bool same_as(const Parameter& other) const { return contents_ == other.contents_; }
  // Name in messages and generated code.
  // Requires: it refers to a Param or an ImageParam.
  const std::string& name() const { return checked("take the name of").name; }
  // Type of the scalar or of the elements.
  Type type() const { return checked("take the type of").type; }
  bool is_buffer() const { return checked("look at").is_buffer; }  // whether it is an ImageParam
  // Number of dimensions; 0 for a scalar.
  int dimensions() const { return checked("take the dimensions of").dimensions; }

  // Value of a scalar parameter, which must have type T.
  // Requires: this is for scalars.
  template <typename T>
  T scalar() const {
    return frontend::from_scalar<T>(
        frontend::get_scalar(checked_scalar("take the value of"), type_of<T>()));
  }
  // Binds the value of a scalar parameter.
  template <typename T>
  void set_scalar(const T& value) {
    frontend::set_scalar(checked_scalar("set the value of"), frontend::to_scalar(value));
  }
  Expr scalar_expr() const;              // the value as a constant Expr
  void set_min_value(const Expr& min);   // sets the lower limit of a scalar
  void set_max_value(const Expr& max);   // sets the upper limit of a scalar
  void set_estimate(const Expr& value);  // states a likely value of a scalar
  // Lower limit of a scalar, or undefined.
  Expr min_value() const { return checked_scalar("take the smallest value of").min_value; }
  // Upper limit of a scalar, or undefined.
  Expr max_value() const { return checked_scalar("take the largest value of").max_value; }
  // Likely value of a scalar, or undefined.
  Expr estimate() const { return checked_scalar("take the estimate of").estimate; }

  // The Buffer that is bound to a buffer parameter, or an undefined one.
  // Requires: this is for buffers.
  Buffer<> buffer() const { return image("take the buffer of").get(); }
  // Binds the Buffer of a buffer parameter.
  void set_buffer(const Buffer<>& buffer) { image("set the buffer of").set(buffer); }
  // Promises the first coordinate of dimension d.
  void set_min_constraint(int d, const Expr& e) { image("constrain").dim(d).set_min(e); }
  // Promises the extent of dimension d.
  void set_extent_constraint(int d, const Expr& e) { image("constrain").dim(d).set_extent(e); }
  // Promises the stride of dimension d, in elements.
  void set_stride_constraint(int d, const Expr& e) { image("constrain").dim(d).set_stride(e); }
  // Promised alignment of the buffer's address, in bytes.
  int host_alignment() const { return image("look at").host_alignment(); }
  // Promises that the buffer's address is a multiple of `bytes`.
  void set_host_alignment(int bytes) { image("align").set_host_alignment(bytes); }

  // The record behind the handle.
  const std::shared_ptr<graph::ParameterContents>& contents() const { return contents_; }
  // Passes the record to functions that take one.
  operator std::shared_ptr<graph::ParameterContents>() const { return contents_; }

 private:
  graph::ParameterContents& checked(const char* asked) const;
  graph::ParameterContents& checked_scalar(const char* asked) const;
  ImageParam image(const char* asked) const;
  std::shared_ptr<graph::ParameterContents> contents_;
};

}  // namespace retrograde
