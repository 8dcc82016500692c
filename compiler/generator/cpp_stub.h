// cpp_stub.h -- support for using one generator inside another one, through a header that the build writes
// (-e cpp_stub):
//
//   auto small = ns::Resize::generate(context(), {input}, {factor});
//   output(x, y) = small.resized(x, y);
//
// The header declares a class with the structs Inputs, GeneratorParams and Outputs and a static function generate(). It
// does not need the source of the generator, which is linked into the program. Inputs and outputs that configure() adds
// are included, for the parameter values with which the header was written.
#pragma once

#include <type_traits>

#include "generator/generator_base.h"
#include "generator/registry.h"

namespace retrograde::internal {

// An image to pass for an Input<Buffer<T>>.
template <typename T = void>
class StubInputBuffer : public ImageParam {
 public:
  StubInputBuffer() = default;
  template <typename T2, int Dims>
  requires(std::is_void_v<T> || std::is_void_v<T2> || std::is_same_v<T, std::remove_const_t<T2>>)
      StubInputBuffer(const Buffer<T2, Dims>& buffer)
      : ImageParam(buffer.parameter()) {}
  StubInputBuffer(const ImageParam& image) : ImageParam(image) {}
};

// The Func of an Output<Buffer<T>>, to be used or realized.
template <typename T = void>
class StubOutputBuffer : public Func {
 public:
  StubOutputBuffer() = default;
  StubOutputBuffer(const Func& f) : Func(f) {}
};

// An array of outputs; converts to a vector of Funcs or images.
struct StubOutputs {
  std::vector<Func> funcs;
  template <typename Output>
  operator std::vector<Output>() const {
    return {funcs.begin(), funcs.end()};
  }
};

}  // namespace retrograde::internal
