// What the checks share: arrays of values, their errors, and inputs in two precisions.
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
// The size that dot(a, b) has when the signs of its terms are random.
double typical(const Values& a, const Values& b);
// The largest magnitude among the finite ones.
double largest(const Values& a);
// Of two numbers that should be equal, relative to the larger of them and `scale`. NaN where one
// is.
double relative_error(double a, double b, double scale);
// worst = max(worst, error), but a NaN wins.
void worsen(double& worst, double error);

// Where an array lies.
struct Shape {
  std::vector<int> mins, extents;
};
size_t count(const Shape& shape);
Shape shape_of_bound(const ParameterContents& p);  // none of a scalar, or where none is bound
// `mins` may be empty: zeros. CompileError, with an example of the call `function`, when one does
// not fit the output.
Shape shape_of_output(const Func& output, const std::vector<int>& mins,
                      const std::vector<int>& sizes, const std::string& asked,
                      const std::string& function);
analysis::Box box_of(const Shape& shape);
Region region_of(const Shape& shape);
// Nothing when the box is not of constants, or too large to look at.
std::optional<Shape> constant_shape(const analysis::Box& box);

Buffer<> new_buffer(Type type, const Shape& shape);
// Of floats of any width.
Values values_of(const Buffer<>& buffer);
void fill(Buffer<>& buffer, const Values& values);
// By reference: what was compiled is kept in the Func, and a copy would be compiled again.
Values realize(Func& f, const Shape& shape);
// One array for each value of the Func; empty for those that are no floats.
std::vector<Values> realize_values(Func& f, const Shape& shape);
// What computes the values of `f` over the shape: `f` itself, or, where nobody scheduled any of its
// Funcs, a copy of them with the built-in schedule. Reductions that read reductions are computed
// again for each read otherwise.
Func scheduled_for(const Func& f, const Shape& shape);
// Many Funcs in one run, so that what they share is compiled and computed once. One after the other
// when that does not work: together they are very large, one reads another outside of its shape, or
// what was inlined into one would have to be stored for two.
class Batch {
 public:
  void add(const Func& f, const Shape& shape);
  size_t size() const { return entries_.size(); }
  std::vector<std::vector<Values>> realize();  // as realize_values, for each that was added

 private:
  struct Entry {
    Func func;
    Shape shape;
    size_t position;  // of its first value among the outputs; a Func may be added twice
  };
  bool realize_together(std::vector<std::vector<Values>>& to);
  std::vector<Entry> entries_;
  std::vector<Func> outputs_;
  std::vector<Shape> shapes_;  // of the outputs
  size_t values_ = 0;
  double elements_ = 0;
  bool together_ = true;
  Pipeline pipeline_;
};

bool is_checkable(Type type);         // a float
double held_by(Type type, double v);  // v as float32 and the type can hold it
// The place of the i-th element of an array.
std::vector<int> place_of(size_t i, const Shape& shape);

// One floating input, as it is bound, and its copy in double.
struct Input {
  std::shared_ptr<ParameterContents> own, wide;
  Shape shape;
  Values values;    // as bound when the check began
  Buffer<> buffer;  // behind `wide`; undefined for scalars

  void set_wide(const Values& to);
  void set_own(const Values& to);  // rounds; of a buffer: in the memory that the user bound
};
// RuntimeError, that one cannot do what is `asked`, when it is not bound.
Input bind_wide(const std::shared_ptr<ParameterContents>& own,
                const std::shared_ptr<ParameterContents>& wide, const std::string& asked);

}  // namespace retrograde::checks
