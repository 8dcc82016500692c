// frame.cpp -- see frame.h.
#include "frame.h"

#include <utility>

#include "solve.h"

namespace fluid {

using retrograde::Expr;
using retrograde::Func;
using retrograde::RDom;
using retrograde::Tuple;
using retrograde::Type;
using retrograde::Var;

namespace {

// Interpolates `field` at a position inside its samples.
Expr between(const Func& field, const Axis& along_x, const Axis& along_y, const Expr& px,
             const Expr& py) {
  const auto cell = [](const Expr& p, const Axis& axis) {
    return retrograde::clamp(retrograde::cast<int>(retrograde::floor(p)), 0, axis.samples - 2);
  };
  const Expr ix = cell(px, along_x), iy = cell(py, along_y);
  const Expr wx = px - retrograde::cast(px.type(), ix), wy = py - retrograde::cast(py.type(), iy);
  const auto row = [&](const Expr& j) {
    const Expr left = field(ix, j), right = field(ix + 1, j);
    return left + wx * (right - left);
  };
  const Expr above = row(iy), below = row(iy + 1);
  return above + wy * (below - above);
}

// The weight of node `i` of `nodes` at `place`, both in units of the box's side: a hat function. The outermost nodes
// are half a node's distance from the walls, and the weight is constant beyond them.
Expr hat(const Expr& i, const Expr& place, int nodes, Type scalar) {
  const auto number = [&](double v) { return retrograde::cast(scalar, Expr(v)); };
  const Expr at =
      retrograde::clamp(place * number(nodes) - number(0.5), number(0), number(nodes - 1.0));
  return retrograde::max(number(1) - retrograde::abs(at - retrograde::cast(scalar, i)), number(0));
}

}  // namespace

Frame::Frame(const FrameShape& shape, Type scalar) : shape(shape), scalar(scalar) {
  add_force();
  advect_velocity();
  if (shape.has_viscosity) diffuse_velocity();
  project();
  move_density();
}

Expr Frame::number(double value) const { return retrograde::cast(scalar, Expr(value)); }

// Component 0 is defined on the faces along x, component 1 on those along y.
Expr Frame::spread_force(const Var& x, const Var& y, int component) const {
  const Expr to_x = component == 0 ? number(0) : number(0.5),
             to_y = component == 1 ? number(0) : number(0.5);
  if (shape.has_force_in_each_cell()) {
    // A face has the mean of its two cells.
    const Expr before_x = component == 0 ? retrograde::clamp(x - 1, 0, shape.width - 1) : Expr(x),
               before_y = component == 1 ? retrograde::clamp(y - 1, 0, shape.height - 1) : Expr(y);
    const Expr after_x = retrograde::clamp(x, 0, shape.width - 1),
               after_y = retrograde::clamp(y, 0, shape.height - 1);
    return number(0.5) *
           (force(before_x, before_y, component) + force(after_x, after_y, component));
  }
  const std::string name = component == 0 ? "force_x" : "force_y";
  const Var i("i"), j("j");
  const RDom along_x(0, shape.force_width), along_y(0, shape.force_height);
  Func hats_x(name + "_hats_x"), hats_y(name + "_hats_y"), rows(name + "_rows"), spread(name);
  hats_x(x, i) = hat(i, (retrograde::cast(scalar, x) + to_x) * number(1.0 / shape.width),
                     shape.force_width, scalar);
  hats_y(j, y) = hat(j, (retrograde::cast(scalar, y) + to_y) * number(1.0 / shape.height),
                     shape.force_height, scalar);
  rows(x, j) = number(0);
  rows(x, j) += hats_x(x, along_x) * force(along_x, j, component);
  spread(x, y) = number(0);
  spread(x, y) += rows(x, along_y) * hats_y(along_y, y);
  return spread(x, y);
}

void Frame::add_force() {
  const Var &x = x_, &y = y_;
  const auto driven = [&](const retrograde::ImageParam& velocity, int component) {
    Expr sum = velocity(x, y);
    if (shape.has_force) sum += time_step * spread_force(x, y, component);
    return sum;
  };
  now_x_(x, y) = retrograde::select(x == 0 || x == shape.width, number(0), driven(velocity_x, 0));
  now_y_(x, y) = retrograde::select(y == 0 || y == shape.height, number(0), driven(velocity_y, 1));
}

// Faces of one direction need the other direction's velocity: the mean of the four faces around them.
void Frame::advect_velocity() {
  const Var &x = x_, &y = y_;
  const int width = shape.width, height = shape.height;
  const Expr reach =
      time_step * number(shape.cells_per_unit());  // from velocity to cells per frame
  const auto clamp = [&](const Expr& p, int last) {
    return retrograde::clamp(p, number(0), number(last));
  };
  const Expr left = retrograde::clamp(x - 1, 0, width - 1),
             right = retrograde::clamp(x, 0, width - 1),
             above = retrograde::clamp(y - 1, 0, height - 1),
             below = retrograde::clamp(y, 0, height - 1);
  const Expr y_on_x = number(0.25) * (now_y_(left, y) + now_y_(right, y) + now_y_(left, y + 1) +
                                      now_y_(right, y + 1)),
             x_on_y = number(0.25) * (now_x_(x, above) + now_x_(x, below) + now_x_(x + 1, above) +
                                      now_x_(x + 1, below));
  const Expr here_x = retrograde::cast(scalar, x), here_y = retrograde::cast(scalar, y);
  Func from_x("from_x"), from_y("from_y"), moved_x("moved_x"), moved_y("moved_y");
  from_x(x, y) = Tuple(clamp(here_x - reach * now_x_(x, y), width),
                       clamp(here_y - reach * y_on_x, height - 1));
  from_y(x, y) = Tuple(clamp(here_x - reach * x_on_y, width - 1),
                       clamp(here_y - reach * now_y_(x, y), height));
  const Axis cells_x{width, Ends::Free}, cells_y{height, Ends::Free},
      faces_x{width + 1, Ends::Zero}, faces_y{height + 1, Ends::Zero};
  moved_x(x, y) =
      retrograde::select(x == 0 || x == width, number(0),
                         between(now_x_, faces_x, cells_y, from_x(x, y)[0], from_x(x, y)[1]));
  moved_y(x, y) =
      retrograde::select(y == 0 || y == height, number(0),
                         between(now_y_, cells_x, faces_y, from_y(x, y)[0], from_y(x, y)[1]));
  now_x_ = moved_x;
  now_y_ = moved_y;
}

void Frame::diffuse_velocity() {
  const int n = shape.cells_per_unit();
  const Expr rate = time_step * viscosity * number(static_cast<double>(n) * n);
  const Axis cells_x{shape.width, Ends::Free}, cells_y{shape.height, Ends::Free},
      faces_x{shape.width + 1, Ends::Zero}, faces_y{shape.height + 1, Ends::Zero};
  const auto solve = [&](const Func& f, const Axis& along_x, const Axis& along_y,
                         const char* name) {
    const System system{f, along_x, along_y, true, rate, scalar, name};
    return shape.solver == Solver::Direct ? solve_directly(system)
                                          : solve_by_iterations(system, shape.iterations);
  };
  now_x_ = solve(now_x_, faces_x, cells_y, "viscous_x");
  now_y_ = solve(now_y_, cells_x, faces_y, "viscous_y");
}

void Frame::project() {
  const Var &x = x_, &y = y_;
  const int width = shape.width, height = shape.height;
  Func inflow("inflow");  // minus the divergence
  inflow(x, y) = now_x_(x, y) - now_x_(x + 1, y) + now_y_(x, y) - now_y_(x, y + 1);
  const System system{inflow, {width, Ends::Free}, {height, Ends::Free}, false, number(1),
                      scalar, "pressure"};
  const Func pressure = shape.solver == Solver::Direct
                            ? solve_directly(system)
                            : solve_by_iterations(system, shape.iterations);
  const auto column = [&](const Expr& n) { return retrograde::clamp(n, 0, width - 1); };
  const auto row = [&](const Expr& n) { return retrograde::clamp(n, 0, height - 1); };
  next_x(x, y) =
      retrograde::select(x == 0 || x == width, number(0),
                         now_x_(x, y) - (pressure(column(x), y) - pressure(column(x - 1), y)));
  next_y(x, y) = retrograde::select(y == 0 || y == height, number(0),
                                    now_y_(x, y) - (pressure(x, row(y)) - pressure(x, row(y - 1))));
}

void Frame::move_density() {
  const Var &x = x_, &y = y_;
  const int width = shape.width, height = shape.height, n = shape.cells_per_unit();
  const Expr half_reach = time_step * number(0.5 * n);
  const auto from = [&](const Var& at, const Expr& before, const Expr& after, int cells) {
    return retrograde::clamp(retrograde::cast(scalar, at) - half_reach * (before + after),
                             number(0), number(cells - 1));
  };
  Func place("from"), moved("moved"), smoke("smoke");
  smoke(x, y) = density(x, y);
  place(x, y) = Tuple(from(x, next_x(x, y), next_x(x + 1, y), width),
                      from(y, next_y(x, y), next_y(x, y + 1), height));
  const Axis along_x{width, Ends::Free}, along_y{height, Ends::Free};
  moved(x, y) = between(smoke, along_x, along_y, place(x, y)[0], place(x, y)[1]);
  Func after = moved;
  if (shape.has_diffusion) {
    const Expr rate = time_step * diffusion * number(static_cast<double>(n) * n);
    const System system{moved, along_x, along_y, true, rate, scalar, "diffused"};
    after = shape.solver == Solver::Direct ? solve_directly(system)
                                           : solve_by_iterations(system, shape.iterations);
  }
  next_density(x, y) = after(x, y);
}

std::vector<std::string> Frame::left_out() const {
  std::vector<std::string> lines;
  if (!shape.has_force) lines.emplace_back("force: there is none and it is not optimized");
  if (shape.has_force && shape.has_force_in_each_cell()) {
    lines.emplace_back("spreading of the force: it has a node in each cell");
  }
  if (!shape.has_viscosity) lines.emplace_back("viscosity: it is 0 and not optimized");
  if (!shape.has_diffusion) lines.emplace_back("diffusion: it is 0 and not optimized");
  return lines;
}

namespace {

retrograde::Derivative differentiate(const Frame& frame, const retrograde::ImageParam& seed_x,
                                     const retrograde::ImageParam& seed_y,
                                     const retrograde::ImageParam& seed_density,
                                     const FrameAdjoint::Wanted& wanted) {
  const int width = frame.shape.width, height = frame.shape.height;
  const RDom on_x(0, width + 1, 0, height), on_y(0, width, 0, height + 1),
      cells(0, width, 0, height);
  Func product("product");
  product() = retrograde::cast(frame.scalar, Expr(0.0));
  product() += frame.next_x(on_x.x, on_x.y) * seed_x(on_x.x, on_x.y);
  product() += frame.next_y(on_y.x, on_y.y) * seed_y(on_y.x, on_y.y);
  product() += frame.next_density(cells.x, cells.y) * seed_density(cells.x, cells.y);
  retrograde::AdjointOptions options;
  options.wrt = {frame.velocity_x, frame.velocity_y, frame.density};
  if (wanted.force) options.wrt.emplace_back(frame.force);
  if (wanted.time_step) options.wrt.emplace_back(frame.time_step);
  if (wanted.viscosity) options.wrt.emplace_back(frame.viscosity);
  if (wanted.diffusion) options.wrt.emplace_back(frame.diffusion);
  return retrograde::propagate_adjoints(product, options);
}

}  // namespace

FrameAdjoint::FrameAdjoint(const FrameShape& shape, Type scalar, const Wanted& wanted)
    : frame(shape, scalar),
      seed_x(scalar, 2, "seed_x"),
      seed_y(scalar, 2, "seed_y"),
      seed_density(scalar, 2, "seed_density"),
      derivative(differentiate(frame, seed_x, seed_y, seed_density, wanted)) {
  gradients = {derivative(frame.velocity_x), derivative(frame.velocity_y),
               derivative(frame.density)};
  if (wanted.force) gradients.push_back(derivative(frame.force));
  if (wanted.time_step) gradients.push_back(derivative(frame.time_step));
  if (wanted.viscosity) gradients.push_back(derivative(frame.viscosity));
  if (wanted.diffusion) gradients.push_back(derivative(frame.diffusion));
}

}  // namespace fluid
