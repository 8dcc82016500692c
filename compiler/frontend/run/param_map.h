// param_map.h -- values of parameters for a single call, which take precedence over values that were set.
//
//   f.realize({n}, target, {{gain, 2.0f}, {image, buffer}});
// The Params and ImageParams do not change, so calls with maps of their own may run on several threads at once.
// infer_input_bounds stores the Buffer that it creates for an ImageParam at the address that the map holds.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>

#include "frontend/data/buffer.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"

namespace retrograde {

// Values of parameters for one call, which take precedence over values that were set.
class ParamMap {
 public:
  // The value of one parameter.
  struct Entry {
    std::optional<ir::Scalar> value;               // of a Param
    Buffer<> buffer;                               // of an ImageParam
    std::function<void(const Buffer<>&)> receive;  // of an ImageParam to be inferred
    halide_buffer_t* raw_buffer() const {
      return buffer.defined() ? buffer.contents()->buffer.raw_buffer() : nullptr;
    }
  };

  // A parameter and its value.
  struct ParamMapping {
    // The value of a Param.
    template <typename T, typename V>
    ParamMapping(const Param<T>& param, const V& value) : parameter(param.parameter()) {
      entry.value = checked(*parameter, frontend::to_scalar(value));
    }
    // The Buffer of an ImageParam.
    template <typename T, int Dims>
    ParamMapping(const ImageParam& image, const Buffer<T, Dims>& buffer)
        : parameter(image.parameter()) {
      entry.buffer = checked(image, buffer);
    }
    // Where infer_input_bounds() stores the Buffer that it creates for an ImageParam.
    template <typename T, int Dims>
    ParamMapping(const ImageParam& image, Buffer<T, Dims>* buffer) : parameter(image.parameter()) {
      checked(image, {});
      entry.receive = [buffer](const Buffer<>& inferred) { *buffer = inferred; };
    }
    std::shared_ptr<graph::ParameterContents> parameter;  // the parameter
    Entry entry;                                          // its value
  };

  ParamMap() = default;  // a map without values
  // A map from pairs: {{gain, 2.0f}, {image, buffer}}.
  ParamMap(std::initializer_list<ParamMapping> mappings) {
    for (const ParamMapping& mapping : mappings) entries_[mapping.parameter] = mapping.entry;
  }
  // Sets the value of a parameter. Throws CompileError if it does not fit the parameter's type or rank.
  template <typename T, typename V>
  void set(const Param<T>& param, const V& value) {
    entries_[param.parameter()] = ParamMapping(param, value).entry;
  }
  // Requires: it needs a type and dimensions.
  void set(const ImageParam& image, const Buffer<>& buffer) {
    entries_[image.parameter()] = ParamMapping(image, buffer).entry;
  }

  size_t size() const { return entries_.size(); }  // number of parameters with values
  static const ParamMap& empty_map();              // a map without values
  // The value of a parameter, or null if the map has none.
  const Entry* find(const std::shared_ptr<graph::ParameterContents>& parameter) const;

 private:
  static ir::Scalar checked(const graph::ParameterContents& parameter, const ir::Scalar& value);
  static Buffer<> checked(const ImageParam& image, const Buffer<>& buffer);
  std::map<std::shared_ptr<graph::ParameterContents>, Entry> entries_;
};

}  // namespace retrograde
