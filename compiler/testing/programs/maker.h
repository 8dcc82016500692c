// maker.h -- the generator of random programs: one object that its parts share.
//
// program.cpp: styles, the order of structures, regions. places.cpp: indices. inputs.cpp: images, and reads of them and
// of Funcs. values.cpp: expressions. functions.cpp: smooth functions, kinks, guarded branches. stages.cpp: Funcs,
// updates, reductions, loops over time. chains.cpp: Funcs at changing resolution. structures.cpp: structures of users'
// programs. pieces.cpp: the same for images of any size. rules.cpp: custom derivatives.
#pragma once

#include "frontend/language/boundary_conditions.h"
#include "testing/programs/program.h"

namespace retrograde::fuzz {

// Values of Funcs are reduced modulo this number, so that a few additions never overflow.
constexpr int wide_modulus = 4096;

// The coordinates of a point, and the Func that is updated there.
struct Point {
  std::vector<Expr> all;    // pure variables, then reduction variables
  std::vector<Expr> write;  // where the update writes
  Func self;
  std::vector<bool> is_pure;  // for each dimension of `self`: whether the update leaves it pure
  bool may_reduce = true;     // false inside of a reduction or of an unfinished Func
  bool in_update() const { return !write.empty(); }
};

class Maker {
 public:
  Maker(Choices& choices, RandomProgram& program, const Style& style)
      : c_(choices), p_(program), s_(style) {}
  void run();

 private:
  void add(Structure what);

  // ---- regions ----
  oracle::Region main_region(size_t output);
  void cover(size_t output, oracle::Region& region) const;
  void add_copy();
  void add_run();

  // ---- places ----
  bool may_stride();
  Expr other(const std::vector<Expr>& all);
  Expr affine(const Expr& u, const std::vector<Expr>& all);
  Expr piecewise(const Expr& u, const std::vector<Expr>& all);
  Expr odd(const Expr& u, const std::vector<Expr>& all);
  // near: an index near `u`, from it and the other coordinates in `all`. inside: the same, within [0, n). by_data: an
  // index in [0, n) that depends on data.
  Expr near(const Expr& u, const std::vector<Expr>& all);
  Expr inside(const Expr& u, const std::vector<Expr>& all, const Expr& n);
  Expr by_data(const Expr& u, const Expr& n);
  Expr place_condition(const std::vector<Expr>& all);  // depends on the coordinates only

  // ---- inputs ----
  void make_inputs();
  static ImageParam handle_of(const Buffer<>& image);
  void fill(Buffer<>& image, bool ties);
  Expr read_image(const Point& at);
  Expr read_func(const Point& at);
  Expr read_self(const Point& at);
  Expr coordinate(const Point& at, int d);
  Expr place(const Point& at, int d);
  const Func& any_func();
  Expr any_value(const FuncRef& ref);

  // ---- values ----
  float weight();
  Expr constant(const Type& type);
  Expr parameter();
  Expr leaf(const Type& type, const Point& at);
  Expr value(const Type& type, const Point& at, int depth);
  Expr integer(const Type& type, const Point& at, int depth);
  Expr smooth(const Type& type, const Point& at, int depth);
  Expr fast(const Type& type, const Point& at, int depth);
  Expr broken(const Type& type, const Point& at, int depth);
  Expr guarded(const Type& type, const Point& at, int depth);
  Expr reduced(const Type& type, const Point& at, int depth);

  // ---- operators of integers ----
  Expr condition(const Point& at, int depth);
  Expr factor(const Type& type, const Point& at, int depth);
  Expr arithmetic(const Type& type, const Point& at, int depth);
  Expr operation(const Type& type, const Point& at, int depth);
  Expr bits(const Type& type, const Point& at, int depth);
  Expr kept_small(const Expr& value, int modulus) const;

  // ---- stages ----
  Region ranges(int most);
  void choose_predicate(RDom& r, const Point& at);
  void finish(const Func& f);
  void add_func(int dimensions);
  void add_sine();
  void add_stencil();
  void add_output();

  // ---- chains ----
  Expr resampled(const Expr& u, int factor, bool reads_coarser);
  void add_link();

  Expr write_place(const RDom& r, size_t d, const std::vector<Var>& vars);
  Expr reached(const RVar& r, size_t d);
  void add_update(Func& f, const std::vector<Var>& vars);
  Expr updated(const Func& f, int k, const Point& at);
  Expr fresh(const Type& type, const Point& at, int depth);
  std::vector<Expr> updated_together(const Func& f, const Point& at);

  // ---- loops over time ----
  void add_loop();
  Expr stepped(const Func& f, int k, const Point& at);

  // ---- structures ----
  void add_structure();
  Expr last_at(const Expr& u, const Expr& v);
  Func define(const std::string& name, const std::vector<Var>& vars, const Expr& value);
  Func define(const std::string& name, const std::vector<Var>& vars, const Tuple& values);
  void add_pyramid();
  Func with_mirrored_border(const Func& f);
  void add_grid();
  void add_convolution();
  void add_table();
  void add_scans();
  void add_two_loops();
  void add_place_of_maximum();
  void add_parametric_sum();
  void add_boundaries();

  // ---- pieces ----
  struct Exact {  // has values at [0, width) x [0, height)
    Func f;
    int width, height;
  };
  void make_exact_image();
  void end_pieces();
  void keep(const Func& f, int width, int height);
  bool is_flat() const { return exact_.front().height == 1; }
  Exact recent();
  Func named(const char* name) { return Func(name + std::to_string(exact_.size())); }
  void add_piece();
  void add_taps();
  void add_window();
  void add_border();
  void add_half();
  void add_row_average();
  void add_histogram();
  void add_recursive_filter();
  void add_pointwise();

  // ---- rules ----
  Expr ruled(const Type& type, const Point& at, int depth);
  void add_custom();

  const Var x{"x"}, y{"y"};
  Choices& c_;
  RandomProgram& p_;
  const Style& s_;
  int budget_ = 0, reads_ = 0, strides_ = 0;
  std::vector<int>
      inlined_reads_;  // for each Func: its image reads if everything is inlined into it
  // The reach of updates of the output, which its regions must contain.
  struct Reach {
    size_t d;
    int low, high;
  };
  std::vector<Reach> reaches_;
  bool is_output_ = false;  // the current Func is the output, with that constraint
  std::vector<Exact> exact_;
};

// Adds a boundary condition to an image, or to a Func over a region.
template <typename Source, typename... Where>
Func bounded(int kind, const Expr& exterior, const Source& source, const Where&... region) {
  using namespace BoundaryConditions;
  if (kind == 0) return repeat_edge(source, region...);
  if (kind == 1) return constant_exterior(source, exterior, region...);
  if (kind == 2) return mirror_image(source, region...);
  return kind == 3 ? repeat_image(source, region...) : mirror_interior(source, region...);
}

std::vector<Var> first_variables(int dimensions);

// Converts `e`, clamping floats: a cast outside of an integer type's range is undefined.
Expr converted(const Type& type, const Expr& e);

// Integers of 32 and 64 bits, whose overflow is undefined.
bool is_wide(const Type& type);

Expr sum_of(const Expr& a, const Expr& b);

}  // namespace retrograde::fuzz
