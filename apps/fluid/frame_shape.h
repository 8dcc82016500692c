// frame_shape.h -- the properties for which a frame is compiled: its sizes, and its stages.
#pragma once

#include <cstdint>

namespace fluid {

// The solver for implicit diffusion and pressure.
enum class Solver : uint8_t {
  Direct,  // cosine transforms: exact for every time step and viscosity
  Jacobi   // a fixed number of iterations: cheaper on large grids, but never exact
};

struct FrameShape {
  int width = 0, height = 0;  // cells
  int force_width = 0;        // nodes of the force, over the whole box
  int force_height = 0;
  bool has_force = true;
  bool has_viscosity = false;
  bool has_diffusion = false;
  Solver solver = Solver::Direct;
  int iterations = 40;  // of Solver::Jacobi

  // Cells along the longer side, whose length is 1.
  int cells_per_unit() const { return width > height ? width : height; }
  bool has_force_in_each_cell() const { return force_width == width && force_height == height; }
  long cells() const { return static_cast<long>(width) * height; }
  // Velocities are on the faces between cells, including walls.
  long faces_x() const { return static_cast<long>(width + 1) * height; }
  long faces_y() const { return static_cast<long>(width) * (height + 1); }
  long state_elems() const { return cells() + faces_x() + faces_y(); }
  // Counts both components.
  long force_elems() const { return has_force ? 2L * force_width * force_height : 0; }
};

}  // namespace fluid
