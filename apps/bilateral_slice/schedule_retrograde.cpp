// schedule_retrograde.cpp -- the hand schedule of a training step.
//
// Everything is done in parallel over pixel rows, except the grid's own gradient and step, which
// are parallel over grid rows. What both directions need is stored once for the photo (the guide,
// the two planes); transforms live in a buffer of 16 pixels. Directions of vectors:
//   along x     everything that is one value a pixel
//   along i     a transform's coefficients: four are adjacent in the grid, and the pixels of a
//   vector
//               along x would come from different layers
//   along k     the curve's knots
#include <vector>

#include "training_pipeline.h"

namespace bilateral_slice {

using lang::Func;
using lang::Stage;
using lang::Var;
using lang::VarOrRVar;

namespace {

constexpr int lanes = 16;

// The loops of update `u` innermost first: its reduction variables, last declared innermost, then
// these.
std::vector<VarOrRVar> reductions_inside(const Func& f, int u, const std::vector<Var>& outside) {
  std::vector<VarOrRVar> order;
  for (const lang::RVar& r : f.rvars(u)) order.emplace_back(r);
  order.insert(order.end(), outside.begin(), outside.end());
  return order;
}

// Vectors along `inner`, all definitions alike.
void vectorize_all(Func f, const Var& inner) {
  f.vectorize(inner, lanes);
  for (int u = 0; u < f.num_update_definitions(); ++u) f.update(u).vectorize(inner, lanes);
}

void parallelize_all(Func f, const Var& outer) {
  f.parallel(outer);
  for (int u = 0; u < f.num_update_definitions(); ++u) f.update(u).parallel(outer);
}

// Updates with a short reduction, unrolled inside the vectors.
void unroll_reduction(Func f, int u, const std::vector<Var>& outside) {
  f.update(u).reorder(reductions_inside(f, u, outside));
  for (const lang::RVar& r : f.rvars(u)) f.update(u).unroll(r);
}

// Stored for the whole photo, row by row in parallel.
void store_rows(Func f, const Var& x, const Var& y) {
  f.compute_root();
  vectorize_all(f, x);
  parallelize_all(f, y);
}

void schedule_forward(Model& m) {
  store_rows(m.light, m.x, m.y);
  unroll_reduction(m.light, 0, {m.x, m.y});
  store_rows(m.guide, m.x, m.y);
  unroll_reduction(m.guide, 0, {m.x, m.y});
  store_rows(m.layer, m.x, m.y);

  const Var tile("tile"), pixel("pixel");
  m.plane.compute_root().vectorize(m.x, lanes).parallel(m.y);
  m.plane.update()
      .split(m.x, tile, pixel, lanes)
      .reorder(m.plane.rvars(0)[0], pixel, m.o, m.k, tile, m.y)
      .unroll(m.plane.rvars(0)[0])
      .vectorize(pixel)
      .unroll(m.o)
      .unroll(m.k)
      .parallel(m.y);
  m.transform.compute_at(m.plane, tile).vectorize(m.i).unroll(m.o).unroll(m.k);
  m.transform.reorder(m.i, m.o, m.k, m.x, m.y);
  m.transform.update()
      .reorder(m.transform.rvars(0)[0], m.i, m.o, m.k, m.x, m.y)
      .unroll(m.transform.rvars(0)[0])
      .vectorize(m.i)
      .unroll(m.o)
      .unroll(m.k);
  m.row_grid.compute_at(m.plane, m.y).vectorize(m.i);
  m.row_loss.compute_root().update().parallel(m.y);
}

void schedule_backward(TrainingPipeline& t) {
  Model& m = t.model;
  store_rows(t.adjoints(m.result), m.x, m.y);
  store_rows(t.adjoints(m.plane), m.x, m.y);

  Func rows = t.adjoints(m.row_grid);
  rows.compute_root().bound(m.i, 0, 4).bound(m.o, 0, 3).vectorize(m.i).parallel(m.y);
  for (int u = 0; u < rows.num_update_definitions(); ++u) {
    std::vector<VarOrRVar> order{m.i, m.o};
    for (const lang::RVar& r : rows.rvars(u)) order.emplace_back(r);
    order.emplace_back(m.y);
    rows.update(u).reorder(order).vectorize(m.i).unroll(m.o).parallel(m.y);
  }
  t.grid.gradient.compute_root().bound(m.i, 0, 4).bound(m.o, 0, 3).vectorize(m.i);
  for (int u = 0; u < t.grid.gradient.num_update_definitions(); ++u) {
    t.grid.gradient.update(u).vectorize(m.i).parallel(m.gy);
  }
  store_rows(t.adjoints(m.guide), m.x, m.y);
  store_rows(t.adjoints(m.light), m.x, m.y);
}

void schedule_steps(TrainingPipeline& t) {
  const Model& m = t.model;
  t.grid.next.bound(m.i, 0, 4)
      .bound(m.o, 0, 3)
      .bound(m.gz, 0, m.shape.grid_z)
      .bound(m.gx, 0, m.shape.grid_x)
      .bound(m.gy, 0, m.shape.grid_y)
      .vectorize(m.i)
      .parallel(m.gy);
}

}  // namespace

void schedule(TrainingPipeline& training, int) {
  schedule_forward(training.model);
  schedule_backward(training);
  schedule_steps(training);
  training.pipeline.compile_jit();
}

}  // namespace bilateral_slice
