#include "gradient/adversary/extern_stage.h"

#include <HalideRuntime.h>

#include <cmath>

namespace {

bool is_query(const halide_buffer_t* b) { return !b->host && !b->device; }

float& element(halide_buffer_t* b, const int* at) {
  int64_t offset = 0;
  for (int d = 0; d < b->dimensions; ++d)
    offset += int64_t{at[d] - b->dim[d].min} * b->dim[d].stride;
  return reinterpret_cast<float*>(b->host)[offset];
}

}  // namespace

// out = sin(in), of at most three dimensions: the region of in is that of out.
extern "C" __attribute__((visibility("default"))) int adversary_sine(halide_buffer_t* in,
                                                                     halide_buffer_t* out) {
  if (is_query(in)) {
    for (int d = 0; d < out->dimensions; ++d) {
      in->dim[d].min = out->dim[d].min;
      in->dim[d].extent = out->dim[d].extent;
    }
    return 0;
  }
  int mins[3] = {0, 0, 0}, ends[3] = {1, 1, 1}, at[3];
  for (int d = 0; d < out->dimensions; ++d) {
    mins[d] = out->dim[d].min;
    ends[d] = mins[d] + out->dim[d].extent;
  }
  for (at[2] = mins[2]; at[2] < ends[2]; ++at[2])
    for (at[1] = mins[1]; at[1] < ends[1]; ++at[1])
      for (at[0] = mins[0]; at[0] < ends[0]; ++at[0]) element(out, at) = std::sin(element(in, at));
  return 0;
}

namespace retrograde::gradient {

void define_sine(Func f, const Func& source) {
  Func(source).compute_root();
  f.define_extern("adversary_sine", {source}, Float(32), Func(source).args());
  f.compute_root();
}

}  // namespace retrograde::gradient
