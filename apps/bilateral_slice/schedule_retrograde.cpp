// schedule_retrograde.cpp -- the manual schedule of a training step.
//
// Everything is parallel over pixel rows, except the grid's own gradient and step, which are parallel over grid rows.
// Values that both directions need (the guide, the two planes) are stored once for the photo; transforms live in a
// buffer of 16 pixels. Parameters that do not move have no adjoints, nor do values that only lead to them. Vectors run
//   along x     for everything with one value per pixel
//   along i     for a transform's coefficients: four are adjacent in the grid (two for gray), and the
//               pixels of a vector along x would come from different layers
//   along k     for the curve's knots
#include <algorithm>
#include <iterator>
#include <vector>

#include "training_pipeline.h"

namespace bilateral_slice {

using lang::Func;
using lang::Stage;
using lang::Var;
using lang::VarOrRVar;

namespace {

constexpr int lanes = 16;
constexpr auto guarded = lang::TailStrategy::GuardWithIf;  // never reads outside the photo
constexpr int short_loop = 4;  // longest loop that is unrolled, in iterations

bool is_short(const lang::RVar& r) {
  const auto extent = lang::ir::as_const_int(r.extent());
  return extent && *extent <= short_loop;
}

// The loop order of update `u`, innermost first: its reduction variables, the last declared one innermost, then
// `outside`.
std::vector<VarOrRVar> reductions_inside(const Func& f, int u, const std::vector<Var>& outside) {
  std::vector<VarOrRVar> order;
  for (const lang::RVar& r : f.rvars(u)) order.emplace_back(r);
  order.insert(order.end(), outside.begin(), outside.end());
  return order;
}

// Vectorizes all definitions along `inner`.
void vectorize_all(Func f, const Var& inner) {
  f.vectorize(inner, lanes, guarded);
  for (int u = 0; u < f.num_update_definitions(); ++u) f.update(u).vectorize(inner, lanes, guarded);
}

void parallelize_all(Func f, const Var& outer) {
  f.parallel(outer);
  for (int u = 0; u < f.num_update_definitions(); ++u) f.update(u).parallel(outer);
}

// For updates with a short reduction: unrolls it inside the vectors.
void unroll_reduction(Func f, int u, const std::vector<Var>& outside) {
  f.update(u).reorder(reductions_inside(f, u, outside));
  for (const lang::RVar& r : f.rvars(u)) f.update(u).unroll(r);
}

// Stores the Func for the whole photo, computed row by row in parallel.
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
  m.plane.compute_root().vectorize(m.x, lanes, guarded).parallel(m.y);
  m.plane.update()
      .split(m.x, tile, pixel, lanes, guarded)
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
  m.row_loss.compute_root()
      .update()
      .atomic()
      .vectorize(m.row_loss.rvars(0)[0], lanes, guarded)
      .parallel(m.y);
}

Func& bound_transform(const Model& m, Func& f) {
  return f.bound(m.i, 0, m.shape.coefficients()).bound(m.o, 0, m.shape.channels);
}

// The inner loops of a Func that gathers the transforms of pixels. Gray has a single output and no loop over it.
std::vector<VarOrRVar> coefficients_and_outputs(const Model& m) {
  if (m.shape.channels > 1) return {m.i, m.o};
  return {m.i};
}

// A pixel adds to four transforms: layers k = 0, 1 of the nodes before and after it. These short loops are unrolled
// around the vector; the loop over a cell's pixels is outside them.
void schedule_row_gradient(const Model& m, Func rows) {
  bound_transform(m, rows.compute_root()).vectorize(m.i).unroll(m.o).parallel(m.y);
  for (int u = 0; u < rows.num_update_definitions(); ++u) {
    const std::vector<lang::RVar> all = rows.rvars(u);
    std::vector<lang::RVar> inner, outer;
    std::partition_copy(all.begin(), all.end(), std::back_inserter(inner),
                        std::back_inserter(outer), is_short);
    std::vector<VarOrRVar> order = coefficients_and_outputs(m);
    order.insert(order.end(), inner.begin(), inner.end());
    order.insert(order.end(), outer.begin(), outer.end());
    order.insert(order.end(), {m.gx, m.y});
    Stage update = rows.update(u);
    update.reorder(order).vectorize(m.i).parallel(m.y);
    if (m.shape.channels > 1) update.unroll(m.o);
    for (const lang::RVar& r : inner) update.unroll(r);
  }
}

void schedule_grid_gradient(const Model& m, Func grid) {
  bound_transform(m, grid.compute_root()).vectorize(m.i).parallel(m.gy);
  for (int u = 0; u < grid.num_update_definitions(); ++u) {
    grid.update(u).reorder(reductions_inside(grid, u, {m.gx, m.gy}));
    std::vector<VarOrRVar> order = coefficients_and_outputs(m);
    order.emplace_back(m.gz);
    grid.update(u).reorder(order).vectorize(m.i).parallel(m.gy);
    if (m.shape.channels > 1) grid.update(u).unroll(m.o);
  }
}

void schedule_guide_gradient(TrainingPipeline& t) {
  const Model& m = t.model;
  const Func guide = t.adjoints(m.guide), depth = t.adjoints(m.depth);
  store_rows(guide, m.x, m.y);
  Func(depth).compute_at(guide, m.y);
  vectorize_all(depth, m.x);
  // A sum over outputs; gray has only one.
  if (depth.num_update_definitions() > 0) unroll_reduction(depth, 0, {m.x, m.y});
}

// Sums over a row's pixels are in double if the photo is wide.
void schedule_curve_gradient(TrainingPipeline& t) {
  const Model& m = t.model;
  Func slopes = t.adjoints.accumulator(t.adjoints(m.row_slopes));
  slopes.compute_root().bound(m.k, 0, m.shape.knots).vectorize(m.k).parallel(m.y);
  slopes.update().reorder(m.k, slopes.rvars(0)[0], m.y).vectorize(m.k).parallel(m.y);
  t.curve->gradient.compute_root();
}

void schedule_mix_gradient(TrainingPipeline& t) {
  const Model& m = t.model;
  const Func light = t.adjoints(m.light);
  store_rows(light, m.x, m.y);
  unroll_reduction(light, 0, {m.x, m.y});
  Func mixture = t.adjoints.accumulator(t.adjoints(m.row_mixture));
  mixture.compute_root().bound(m.i, 0, m.shape.coefficients()).vectorize(m.i).parallel(m.y);
  mixture.update().reorder(m.i, mixture.rvars(0)[0], m.y).vectorize(m.i).parallel(m.y);
  t.mix->gradient.compute_root();
}

void schedule_backward(TrainingPipeline& t) {
  const Model& m = t.model;
  t.adjoints(m.row_loss).compute_root();
  store_rows(t.adjoints(m.result), m.x, m.y);
  if (t.grid) {
    store_rows(t.adjoints(m.plane), m.x, m.y);
    t.adjoints(m.transform).compute_inline();
    schedule_row_gradient(m, t.adjoints(m.row_grid));
    schedule_grid_gradient(m, t.grid->gradient);
  }
  if (t.curve || t.mix) schedule_guide_gradient(t);
  if (t.curve) schedule_curve_gradient(t);
  if (t.mix) schedule_mix_gradient(t);
}

void schedule_steps(TrainingPipeline& t) {
  if (!t.grid) return;
  const Model& m = t.model;
  bound_transform(m, t.grid->next)
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
