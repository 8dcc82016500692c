// param_map.h -- values of parameters for one call, in place of those that were set.
//
//   f.realize({n}, target, {{gain, 2.0f}, {image, buffer}});
// The Params and ImageParams themselves stay as they are, so that calls with maps of their own may
// run on several threads at once. infer_input_bounds puts what it makes for an ImageParam into the
// Buffer whose address the map holds.
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

class ParamMap {
 public:
  // What stands for one parameter.
  struct Entry {
    std::optional<ir::Scalar> value;               // of a Param
    Buffer<> buffer;                               // of an ImageParam
    std::function<void(const Buffer<>&)> receive;  // of an ImageParam that is to be inferred
    halide_buffer_t* raw_buffer() const {
      return buffer.defined() ? buffer.contents()->buffer.raw_buffer() : nullptr;
    }
  };

  struct ParamMapping {
    template <typename T, typename V>
    ParamMapping(const Param<T>& param, const V& value) : parameter(param.parameter()) {
      entry.value = checked(*parameter, frontend::to_scalar(value));
    }
    template <typename T, int Dims>
    ParamMapping(const ImageParam& image, const Buffer<T, Dims>& buffer)
        : parameter(image.parameter()) {
      entry.buffer = checked(image, buffer);
    }
    template <typename T, int Dims>
    ParamMapping(const ImageParam& image, Buffer<T, Dims>* buffer) : parameter(image.parameter()) {
      checked(image, {});
      entry.receive = [buffer](const Buffer<>& made) { *buffer = made; };
    }
    std::shared_ptr<graph::ParameterContents> parameter;
    Entry entry;
  };

  ParamMap() = default;
  ParamMap(std::initializer_list<ParamMapping> mappings) {
    for (const ParamMapping& mapping : mappings) entries_[mapping.parameter] = mapping.entry;
  }
  // CompileError when the value does not fit the parameter's type, or the buffer its type and
  // dimensions.
  template <typename T, typename V>
  void set(const Param<T>& param, const V& value) {
    entries_[param.parameter()] = ParamMapping(param, value).entry;
  }
  // Requires: it needs a type and dimensions.
  void set(const ImageParam& image, const Buffer<>& buffer) {
    entries_[image.parameter()] = ParamMapping(image, buffer).entry;
  }

  size_t size() const { return entries_.size(); }  // how many parameters it gives values to
  static const ParamMap& empty_map();
  // Null when the map says nothing of it.
  const Entry* find(const std::shared_ptr<graph::ParameterContents>& parameter) const;

 private:
  static ir::Scalar checked(const graph::ParameterContents& parameter, const ir::Scalar& value);
  static Buffer<> checked(const ImageParam& image, const Buffer<>& buffer);
  std::map<std::shared_ptr<graph::ParameterContents>, Entry> entries_;
};

}  // namespace retrograde
