// workload_maker.h -- the generator of workloads.
//
// workloads.cpp: sizes, inputs, the order of pieces, outputs. time_loops.cpp: loops that keep their steps.
// recurrences.cpp: loops in place, recursive filters, sweeps over two dimensions. strides.cpp: convolutions, hops,
// resampling. index_arrays.cpp: gathers, scatters, constant indices.
#pragma once

#include "testing/programs/workloads.h"

namespace retrograde::fuzz {

class WorkloadMaker {
 public:
  WorkloadMaker(Choices& choices, RandomProgram& program) : c_(choices), p_(program) {}
  void run(Workload kind);

 private:
  // A Func with values at [0, width) x [0, height). A line has the first dimension only, and height 1.
  struct Grid {
    Func f;
    int width = 0, height = 1;
    bool is_line = true;
    Expr operator()(const Expr& u, const Expr& v) const {
      return is_line ? Expr(f(u)) : Expr(f(u, v));
    }
  };
  // A piece may not apply to a grid; then its result has no Func.
  using Piece = Grid (WorkloadMaker::*)(const Grid& a);
  // An input, as an expression of its coordinates.
  using Input = std::function<Expr(const std::vector<Expr>& place)>;

  // ---- workloads.cpp ----
  int extent();
  Func named(const char* name) { return Func(name + std::to_string(p_.funcs.size())); }
  void keep(const Grid& grid);
  // Defines a Func at (x, y) or, for a line, at (x).
  Grid grid(const char* name, int width, int height, bool is_line, const Tuple& values);
  Grid grid_like(const Grid& a, const char* name, const Expr& value);
  Grid line(const char* name, int width, const Expr& value);
  std::vector<Var> variables(bool is_line) const;
  // At most most_inputs are made; later calls return a constant.
  Input input(const std::vector<int>& extents);
  Grid input_grid();
  // The grid with values everywhere, by a boundary condition.
  Grid with_border(const Grid& a);
  Expr smooth(const Expr& a);
  Expr coefficient();
  Grid recent();
  void add_piece(Workload kind);
  void add_output(const Grid& a);
  void make_output(const Func& f, const std::vector<int>& extents);
  oracle::Region part_of(const std::vector<int>& extents);

  // ---- time_loops.cpp ----
  enum class Border : uint8_t { Clamp, Interior, Zero, Periodic, Open };
  struct TimeLoop {
    Func u;
    int width, height, steps, back, slots;  // slots: the initial states, then the steps
    int values, time_at;                    // time_at: the position of time among the dimensions
    Border border;
    bool is_line, is_reversed, is_x_pure, is_y_pure, sweeps;
    Expr x, y, t;  // the point that is stepped; t counts the slots from the first initial state
    std::vector<Expr> at(const Expr& x, const Expr& y, const Expr& t) const;
    Expr slot(const Expr& t) const { return is_reversed ? slots - 1 - t : t; }
    bool moves_x() const { return !is_x_pure; }
    bool moves_y() const { return !is_y_pure && !is_line; }
  };
  TimeLoop choose_loop(const Grid& start);
  void define_start(TimeLoop& loop, const Grid& start);
  void choose_domain(TimeLoop& loop);
  Range along(const TimeLoop& loop, int size) const;
  Expr moved(const TimeLoop& loop, const Expr& u, int by, int size) const;
  Expr neighbour(const TimeLoop& loop, int dx, int dy, int ago, int value = 0) const;
  Expr sides(const TimeLoop& loop) const;
  int side_count(const TimeLoop& loop) const { return loop.moves_x() * 2 + loop.moves_y() * 2; }
  Expr place_coefficient(const TimeLoop& loop);
  Expr linear_step(const TimeLoop& loop);
  Expr nonlinear_step(const TimeLoop& loop);
  Expr swept_step(const TimeLoop& loop);
  Grid steps_read(const TimeLoop& loop);
  Grid kept_steps(const Grid& a);

  // ---- recurrences.cpp ----
  Grid swept_in_place(const Grid& a);
  Grid red_black(const Grid& a);
  Grid recursive_filters(const Grid& a);
  Grid aligned(const Grid& a);
  Grid matrix_powers(const Grid& a);

  // ---- strides.cpp ----
  Grid strided_convolution(const Grid& a);
  Grid dilated_window(const Grid& a);
  Grid transposed_by_scatter(const Grid& a);
  Grid transposed_by_division(const Grid& a);
  Grid by_phases(const Grid& a);
  Grid frames_of(const Grid& a);
  Grid overlap_added(const Grid& a);
  Grid downsampled(const Grid& a);
  Grid upsampled(const Grid& a);
  Grid there_and_back(const Grid& a);
  Grid shuffled(const Grid& a);
  Grid by_parity(const Grid& a);
  Grid by_remainder(const Grid& a);
  Grid lifted(const Grid& a);

  // ---- index_arrays.cpp ----
  // An integer input with `count` elements, as an expression of the element: values in [low, high], or indices in
  // [0, size) that are clamped or promised.
  using Index = std::function<Expr(const Expr& i)>;
  Index integers(int count, int low, int high);
  Index indices(int count, int size);
  Grid gathered(const Grid& a);
  Grid gathered_from_border(const Grid& a);
  Grid gathered_pairs(const Grid& a);
  Grid scattered(const Grid& a);
  Grid overwritten_by_index(const Grid& a);
  Grid messages(const Grid& a);
  Grid sparse_product(const Grid& a);
  Grid segments(const Grid& a);
  Grid residuals(const Grid& a);
  Grid channels_mixed(const Grid& a);
  Grid interpolated(const Grid& a);

  static const std::vector<Piece>& pieces_of(Workload kind);

  static constexpr size_t most_inputs = 5;
  const Var x{"x"}, y{"y"}, t{"t"};
  Choices& c_;
  RandomProgram& p_;
  std::vector<Grid> grids_;
  int index_arrays_ = 0;
  bool count_is_used_ = false;  // as the number of steps of a loop
};

}  // namespace retrograde::fuzz
