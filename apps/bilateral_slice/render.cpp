// render.cpp -- see render.h.
#include "render.h"

#include "model.h"

namespace bilateral_slice {

namespace {

// Row by row, so that only the result is as large as the photo.
void schedule(Model& m) {
  const auto guarded = lang::TailStrategy::GuardWithIf;  // never reads outside the photo
  m.result.reorder(m.x, m.o, m.y).vectorize(m.x, 8, guarded).parallel(m.y);
  m.row_grid.compute_at(m.result, m.y).vectorize(m.i, m.shape.coefficients());
  for (lang::Func f : {m.light, m.guide, m.plane}) {
    f.compute_at(m.result, m.y).vectorize(m.x, 8, guarded);
    f.update().vectorize(m.x, 8, guarded);
  }
}

}  // namespace

void render(const Shape& shape, float* photo, const lang::Buffer<float>& grid,
            const lang::Buffer<float>& mix, const lang::Buffer<float>& curve, float* result) {
  Model model(shape, lang::Float(32));
  schedule(model);
  model.photo.set(lang::Buffer<float>(photo, shape.width, shape.height, shape.coefficients()));
  model.grid.set(grid);
  model.mix.set(mix);
  model.curve.set(curve);
  lang::Buffer<float> out(result, shape.width, shape.height, shape.channels);
  model.result.realize(out);
}

}  // namespace bilateral_slice
