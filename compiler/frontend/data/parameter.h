// parameter.h -- a Param or an ImageParam whose kind and type are known at run time only: what
// parameter() of both converts to.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "frontend/data/image_param.h"
#include "frontend/data/param.h"

namespace retrograde {

class Parameter {
 public:
  Parameter() = default;
  Parameter(std::shared_ptr<graph::ParameterContents> contents) : contents_(std::move(contents)) {}
  Parameter(const Type& type, bool is_buffer, int dimensions)
      : Parameter(type, is_buffer, dimensions, "") {}
  // Requires: a scalar has no dimensions.
  Parameter(const Type& type, bool is_buffer, int dimensions, const std::string& name);

  bool defined() const { return contents_ != nullptr; }
  bool same_as(const Parameter& other) const { return contents_ == other.contents_; }
  // Requires: it stands for a Param or an ImageParam.
  const std::string& name() const { return checked("take the name of").name; }
  Type type() const { return checked("take the type of").type; }  // of a scalar, or of elements
  bool is_buffer() const { return checked("look at").is_buffer; }
  int dimensions() const { return checked("take the dimensions of").dimensions; }

  // Of scalars, as a value of their type.
  // Requires: this is for scalars.
  template <typename T>
  T scalar() const {
    return frontend::from_scalar<T>(
        frontend::get_scalar(checked_scalar("take the value of"), type_of<T>()));
  }
  template <typename T>
  void set_scalar(const T& value) {
    frontend::set_scalar(checked_scalar("set the value of"), frontend::to_scalar(value));
  }
  Expr scalar_expr() const;
  void set_min_value(const Expr& min);
  void set_max_value(const Expr& max);
  void set_estimate(const Expr& value);
  Expr min_value() const { return checked_scalar("take the smallest value of").min_value; }
  Expr max_value() const { return checked_scalar("take the largest value of").max_value; }
  Expr estimate() const { return checked_scalar("take the estimate of").estimate; }

  // Of buffers.
  // Requires: this is for buffers.
  Buffer<> buffer() const { return image("take the buffer of").get(); }
  void set_buffer(const Buffer<>& buffer) { image("set the buffer of").set(buffer); }
  void set_min_constraint(int d, const Expr& e) { image("constrain").dim(d).set_min(e); }
  void set_extent_constraint(int d, const Expr& e) { image("constrain").dim(d).set_extent(e); }
  void set_stride_constraint(int d, const Expr& e) { image("constrain").dim(d).set_stride(e); }
  int host_alignment() const { return image("look at").host_alignment(); }
  void set_host_alignment(int bytes) { image("align").set_host_alignment(bytes); }

  const std::shared_ptr<graph::ParameterContents>& contents() const { return contents_; }
  operator std::shared_ptr<graph::ParameterContents>() const { return contents_; }

 private:
  graph::ParameterContents& checked(const char* asked) const;
  graph::ParameterContents& checked_scalar(const char* asked) const;
  ImageParam image(const char* asked) const;
  std::shared_ptr<graph::ParameterContents> contents_;
};

}  // namespace retrograde
