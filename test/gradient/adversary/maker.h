// How a program is put together: one object that the parts of the generator share.
//
// program.cpp: the order of things. inputs.cpp: images, and reads of them and of Funcs. values.cpp:
// expressions. functions.cpp: smooth functions, kinks, guarded branches. stages.cpp: Funcs,
// updates, reductions. loops.cpp: loops over time. structures.cpp: what programs of users are made
// of. rules.cpp: derivatives that the author writes.
#pragma once

#include "gradient/adversary/places.h"
#include "gradient/adversary/program.h"

namespace retrograde::gradient {

// The coordinates of a point, and the Func that is being updated there.
struct Point {
  std::vector<Expr> all;    // pure variables, then reduction variables
  std::vector<Expr> write;  // where the update writes
  Func self;
  std::vector<bool> is_pure;  // dimensions of `self` that the update leaves alone
  bool in_update() const { return !write.empty(); }
};

class Maker {
 public:
  Maker(Choices& choices, AdversaryProgram& program, bool as_extern)
      : c_(choices),
        p_(program),
        places_(choices, program.data, program.count),
        as_extern_(as_extern) {}
  void run();

 private:
  void choose_checks();
  int side_of_output();
  Overwritten overwriting();

  // ---- inputs ----
  void make_inputs();
  Type image_type();
  static ImageParam handle_of(const Buffer<>& image);
  void fill(Buffer<>& image, bool ties);
  Expr read_image(const Point& at);
  Expr read_func(const Point& at);
  Expr read_self(const Point& at);
  Expr coordinate(const Point& at, int d);
  const Func& any_func();
  Expr any_value(const FuncRef& ref);

  // ---- values ----
  float weight();
  Expr constant(const Type& type);
  Expr leaf(const Type& type, const Point& at);
  Expr value(const Type& type, const Point& at, int depth);
  Expr integer(const Type& type, const Point& at, int depth);
  Expr smooth(const Type& type, const Point& at, int depth);
  Expr fast(const Type& type, const Point& at, int depth);
  Expr broken(const Type& type, const Point& at, int depth);
  Expr guarded(const Type& type, const Point& at, int depth);
  Expr reduced(const Type& type, const Point& at, int depth);

  // ---- stages ----
  Type value_type();
  Region ranges(int most);
  RDom domain(int most);
  void add_func(int dimensions);
  void add_chain();
  void add_output();
  Expr write_place(const RDom& r, size_t d, const std::vector<Var>& vars);
  void add_update(Func& f, const std::vector<Var>& vars);
  Expr updated(const Func& f, int k, const Point& at);

  // ---- loops over time ----
  void add_loop();
  Expr stepped(const Func& f, int k, const Point& at);

  // ---- structures ----
  Expr last_at(const Expr& u, const Expr& v);
  Func define(const std::string& name, const std::vector<Var>& vars, const Expr& value);
  Func define(const std::string& name, const std::vector<Var>& vars, const Tuple& values);
  void add_structure();
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

  // ---- rules ----
  Expr ruled(const Type& type, const Point& at, int depth);
  void add_custom();

  Choices& c_;
  AdversaryProgram& p_;
  Places places_;
  const bool as_extern_;
  int budget_ = 0;
};

std::vector<Var> first_variables(int dimensions);

// Outside of an integer type's range casts are undefined: floats are clamped.
Expr converted(const Type& type, const Expr& e);

}  // namespace retrograde::gradient
