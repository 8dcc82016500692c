// render.cpp -- see render.h.
#include "render.h"

#include "model.h"

namespace bilateral_slice {

namespace {

// Row by row: nothing the size of the photo is stored but the result.
void schedule(Model& m) {
  m.result.reorder(m.x, m.o, m.y).vectorize(m.x, 8).parallel(m.y);
  m.row_grid.compute_at(m.result, m.y).vectorize(m.i, 4);
  m.light.compute_at(m.result, m.y).vectorize(m.x, 8);
  m.light.update().vectorize(m.x, 8);
  m.guide.compute_at(m.result, m.y).vectorize(m.x, 8);
  m.guide.update().vectorize(m.x, 8);
  m.plane.compute_at(m.result, m.y).vectorize(m.x, 8);
  m.plane.update().vectorize(m.x, 8);
}

}  // namespace

void render(const Shape& shape, float* photo, const lang::Buffer<float>& grid,
            const lang::Buffer<float>& mix, const lang::Buffer<float>& curve, float* result) {
  Model model(shape, lang::Float(32));
  schedule(model);
  model.photo.set(lang::Buffer<float>(photo, shape.width, shape.height, 4));
  model.grid.set(grid);
  model.mix.set(mix);
  model.curve.set(curve);
  lang::Buffer<float> out(result, shape.width, shape.height, 3);
  model.result.realize(out);
}

}  // namespace bilateral_slice
