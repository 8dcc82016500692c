// frame.h -- one frame of a fluid in a closed box, and its vector-Jacobian product.
//
//   velocity  += time_step force                                   force
//   velocity   = velocity where time_step ago it was                advection, along itself
//   velocity   = (1 + time_step viscosity L)^-1 velocity            viscosity
//   velocity  -= slope of the pressure that takes its divergence away  projection
//   density    = density where time_step ago it was                 advection, along the new velocity
//   density    = (1 + time_step diffusion L)^-1 density             diffusion
//
// after J. Stam, Stable Fluids, SIGGRAPH 1999, section 2: unconditionally stable. The density is in
// the middle of cells, the velocity on the faces between them (Harlow and Welch, Physics of Fluids
// 8, 1965), so that the projection leaves no divergence at all. The box's longer side has length 1.
#pragma once

#include <retrograde/retrograde.h>

#include <string>
#include <vector>

#include "frame_shape.h"

namespace fluid {

class Frame {
 public:
  // `scalar` is the type of everything: float to simulate, double to check.
  Frame(const FrameShape& shape, retrograde::Type scalar);

  FrameShape shape;
  retrograde::Type scalar;

  // Before the frame.
  retrograde::ImageParam velocity_x;  // [height, width + 1], width innermost
  retrograde::ImageParam velocity_y;  // [height + 1, width]
  retrograde::ImageParam density;     // [height, width]
  retrograde::ImageParam force;       // [2, force_height, force_width]
  retrograde::Param<> time_step, viscosity, diffusion;

  // After it.
  retrograde::Func next_x{"next_x"}, next_y{"next_y"}, next_density{"next_density"};

  // What was left out, a line each.
  std::vector<std::string> left_out() const;

 private:
  using Expr = retrograde::Expr;
  using Func = retrograde::Func;

  Expr number(double value) const;
  Expr spread_force(const retrograde::Var& x, const retrograde::Var& y, int component) const;
  void add_force();
  void advect_velocity();
  void diffuse_velocity();
  void project();
  void move_density();

  const retrograde::Var x_{"x"}, y_{"y"};
  Func now_x_, now_y_;  // the velocity as far as it is computed
};

// gradient of  seed . (next_x, next_y, next_density)  by what went into the frame.
class FrameAdjoint {
 public:
  struct Wanted {
    bool force = true;
    bool time_step = false, viscosity = false, diffusion = false;
  };
  FrameAdjoint(const FrameShape& shape, retrograde::Type scalar, const Wanted& wanted);

  Frame frame;
  retrograde::ImageParam seed_x, seed_y, seed_density;  // as the state after the frame
  retrograde::Derivative derivative;
  // velocity_x, velocity_y, density, then what is wanted, in the order of Wanted.
  std::vector<retrograde::Func> gradients;
};

}  // namespace fluid
