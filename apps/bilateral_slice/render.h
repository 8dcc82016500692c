// render.h -- applies a learned look to a photo.
#pragma once

#include "language.h"
#include "shape.h"

namespace bilateral_slice {

// photo: [coefficients, height, width] -> result: [channels, height, width].
void render(const Shape& shape, float* photo, const lang::Buffer<float>& grid,
            const lang::Buffer<float>& mix, const lang::Buffer<float>& curve, float* result);

}  // namespace bilateral_slice
