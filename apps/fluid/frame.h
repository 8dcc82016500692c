// frame.h -- one time step ("frame") of a fluid in a closed box, and its vector-Jacobian product.
//
//   velocity  += time_step force                                   force
//   velocity   = velocity at the position time_step ago             advection, along itself
//   velocity   = (1 + time_step viscosity L)^-1 velocity            viscosity
//   velocity  -= gradient of the pressure that removes divergence   projection
//   density    = density at the position time_step ago              advection, along the new velocity
//   density    = (1 + time_step diffusion L)^-1 density             diffusion
//
// after J. Stam, Stable Fluids, SIGGRAPH 1999, section 2: unconditionally stable. The density is at the centres of
// cells, and the velocity on the faces between them (Harlow and Welch, Physics of Fluids 8, 1965), so that the
// projection removes divergence exactly. The box's longer side has length 1.
#pragma once

#include <retrograde/retrograde.h>

#include <string>
#include <vector>

#include "frame_shape.h"

namespace fluid {

class Frame {
 public:
  // `scalar` is the type of all values: float to simulate, double to check.
  Frame(const FrameShape& shape, retrograde::Type scalar);

  FrameShape shape;
  retrograde::Type scalar;

  // The state before the frame, with the width innermost.
  retrograde::ImageParam velocity_x{scalar, 2, "velocity_x"};  // [height, width + 1]
  retrograde::ImageParam velocity_y{scalar, 2, "velocity_y"};  // [height + 1, width]
  retrograde::ImageParam density{scalar, 2, "density"};        // [height, width]
  retrograde::ImageParam force{scalar, 3, "force"};            // [2, force_height, force_width]
  retrograde::Param<> time_step{scalar, "time_step"}, viscosity{scalar, "viscosity"},
      diffusion{scalar, "diffusion"};

  // The state after the frame.
  retrograde::Func next_x{"next_x"}, next_y{"next_y"}, next_density{"next_density"};

  // The stages that are left out, one line each.
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
  Func now_x_{"driven_x"}, now_y_{"driven_y"};  // the velocity after the stages so far
};

// The gradient of  seed . (next_x, next_y, next_density)  by the frame's inputs.
class FrameAdjoint {
 public:
  struct Wanted {
    bool force = true;
    bool time_step = false, viscosity = false, diffusion = false;
  };
  FrameAdjoint(const FrameShape& shape, retrograde::Type scalar, const Wanted& wanted);

  Frame frame;
  retrograde::ImageParam seed_x, seed_y, seed_density;  // like the state after the frame
  retrograde::Derivative derivative;
  // velocity_x, velocity_y, density, then the wanted ones in the order of Wanted.
  std::vector<retrograde::Func> gradients;
};

}  // namespace fluid
