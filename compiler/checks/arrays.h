// arrays.h -- helpers that all checks share: arrays of values, their errors, and inputs in two precisions.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/interval.h"
#include "frontend/data/buffer.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"

namespace retrograde::checks {

using Values = std::vector<double>;

double dot(const Values& a, const Values& b);
// The typical size of dot(a, b) if the signs of its terms are random.
double typical(const Values& a, const Values& b);
// The largest magnitude among the finite values.
double largest(const Values& a);
// The error between two numbers that should be equal, relative to the larger of them and `scale`. NaN if one of them is
// NaN.
double relative_error(double a, double b, double scale);
// worst = max(worst, error); a NaN always replaces it.
void worsen(double& worst, double error);

// The region of an array.
struct Shape {
  std::vector<int> mins, extents;
};
size_t count(const Shape& shape);
Shape shape_of_bound(const ParameterContents& p);  // empty for scalars and unbound images
// Empty `mins` means zeros. Throws CompileError, with an example call of `function`, if the sizes do not fit the
// output.
Shape shape_of_output(const Func& output, const std::vector<int>& mins,
                      const std::vector<int>& sizes, const std::string& asked,
                      const std::string& function);
analysis::Box box_of(const Shape& shape);
Region region_of(const Shape& shape);
// nullopt if the box is not constant or is too large to check.
std::optional<Shape> constant_shape(const analysis::Box& box);

Buffer<> new_buffer(Type type, const Shape& shape);
// The values of a buffer of floats of any width.
Values values_of(const Buffer<>& buffer);
void fill(Buffer<>& buffer, const Values& values);
// Takes the Func by reference: the compiled code is cached in the Func, and a copy would be compiled again.
Values realize(Func& f, const Shape& shape);
// One array for each value of the Func; empty for values that are no floats.
std::vector<Values> realize_values(Func& f, const Shape& shape);
// The Func that computes the values of `f` over the shape: `f` itself if any of its Funcs has directives; else a copy
// with the built-in schedule, without which reductions that read reductions are recomputed for each read.
Func scheduled_for(const Func& f, const Shape& shape);
// Runs many Funcs together, so that shared producers are compiled and computed once. Runs them one after the other if
// that does not work: together they are very large, one reads another outside of its shape, or a Func that one inlines
// would have to be stored for two.
class Batch {
 public:
  void add(const Func& f, const Shape& shape);
  size_t size() const { return entries_.size(); }
  std::vector<std::vector<Values>> realize();  // realize_values of each added Func

 private:
  struct Entry {
    Func func;
    Shape shape;
    size_t position;  // index of its first value among the outputs; a Func may be added twice
  };
  bool realize_together(std::vector<std::vector<Values>>& to);
  std::vector<Entry> entries_;
  std::vector<Func> outputs_;
  std::vector<Shape> shapes_;  // shapes of the outputs
  size_t values_ = 0;
  double elements_ = 0;
  bool together_ = true;
  Pipeline pipeline_;
};

bool is_checkable(Type type);         // whether it is a float
double held_by(Type type, double v);  // v, rounded to float32, or to the type if that is narrower
// The coordinates of the i-th element of an array.
std::vector<int> place_of(size_t i, const Shape& shape);

// One floating-point input as the user bound it, and its copy in double.
struct Input {
  std::shared_ptr<ParameterContents> own, wide;
  Shape shape;
  Values values;    // the values when the check began
  Buffer<> buffer;  // memory of `wide`; undefined for scalars

  void set_wide(const Values& to);
  void set_own(const Values& to);  // rounds; writes into the memory that the user bound
};
// Throws RuntimeError ("cannot" + `asked`) if the input is not bound.
Input bind_wide(const std::shared_ptr<ParameterContents>& own,
                const std::shared_ptr<ParameterContents>& wide, const std::string& asked);

}  // namespace retrograde::checks
