// program.h -- the interface of benchmark programs: a generator as users of Halide write it, and the arguments of its
// function, in one source file that is compiled once with Halide 14's header and once with ours. list.def names all
// programs.
#pragma once

#include <Halide.h>

#include <functional>
#include <string>
#include <vector>

#include "cases.h"

namespace programs {

// The base of a generator whose pictures have the coordinates x, y and c.
template <typename T>
struct PictureGenerator : Halide::Generator<T> {
 protected:
  Halide::Var x{"x"}, y{"y"}, c{"c"};
};

// The base of a generator that makes a picture from a picture, and from the inputs that it adds.
template <typename T, typename Pixel, int in_dims, typename OutPixel = Pixel,
          int out_dims = in_dims>
struct Filter : PictureGenerator<T> {
  Halide::GeneratorInput<Halide::Buffer<Pixel>> input{"input", in_dims};
  Halide::GeneratorOutput<Halide::Buffer<OutPixel>> output{"output", out_dims};

 protected:
  // Computes the three channels of the output in tiles of 64 columns; rows of tiles run in parallel.
  void tile_colours(int rows) {
    Halide::Var xi("xi"), yi("yi");
    output.bound(this->c, 0, 3).tile(this->x, this->y, xi, yi, 64, rows);
    output.reorder(xi, yi, this->c, this->x, this->y).parallel(this->y);
    output.vectorize(xi, this->template natural_vector_size<float>());
  }
};

// A program with its generator parameters.
struct Registered {
  Program program;
  std::vector<std::string> params;  // "name=value"

  Registered& threads(int count) {
    for (Case& c : program.cases) c.threads = count;
    return *this;
  }
  Registered& tolerance(double most) {
    program.tolerance = most;
    return *this;
  }
  // The first inputs have gradients, whose outputs follow the sum.
  Registered& gradients(int count) {
    program.gradients = count;
    return *this;
  }
  Registered& with(const std::string& param) {
    params.push_back(param);
    return *this;
  }
};

// One case for each size; there are one to three: small, medium, large.
using Sizes = std::vector<int>;
inline Registered at_sizes(const std::vector<Sizes>& sizes,
                           const std::function<std::vector<Argument>(const Sizes&)>& arguments) {
  static const char* const labels[] = {"small", "medium", "large"};
  Registered all;
  for (size_t i = 0; i < sizes.size(); i++)
    all.program.cases.push_back({labels[i], 0, arguments(sizes[i])});
  return all;
}

// All programs of this process.
std::vector<Registered>& registered();
inline bool add(const char* name, Registered program) {
  program.program.name = name;
  registered().push_back(std::move(program));
  return true;
}

}  // namespace programs

// At the end of a file: PROGRAM(name, generator class, at_sizes(...)).
#define PROGRAM(name, Class, ...)                                                    \
  HALIDE_REGISTER_GENERATOR(Class, name)                                             \
  namespace programs {                                                               \
  [[maybe_unused]] static const bool name##_is_registered = add(#name, __VA_ARGS__); \
  }
