// arrays.h -- helpers of the checks: arrays of values, their errors, and inputs in two precisions.
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
// The sum of dot(values[k], weights[k]) where there are weights.
double weighted_sum(const std::vector<Values>& values, const std::vector<Values>& weights);
// The expected magnitude of dot(a, b) if the signs of its terms are random.
double typical(const Values& a, const Values& b);
// The largest magnitude among the finite elements.
double largest(const Values& a);
// The difference of two numbers relative to the largest of |a|, |b| and `scale`; NaN if either is.
double relative_error(double a, double b, double scale);
// worst = max(worst, error), where NaN counts as the largest value.
void worsen(double& worst, double error);

// Mins and extents of an array.
struct Shape {
  std::vector<int> mins, extents;
};
size_t count(const Shape& shape);
// The images and scalars of floats that the output depends on.
std::vector<std::shared_ptr<ParameterContents>> floating_inputs(const Func& output);
// The shape of the bound buffer; empty for a scalar or without a buffer.
Shape shape_of_bound(const ParameterContents& p);
// The shape from `mins`, where empty means zeros, and `sizes`. If one does not fit the output, throws
// CompileError with an example of a call of `function`.
Shape shape_of_output(const Func& output, const std::vector<int>& mins,
                      const std::vector<int>& sizes, const std::string& asked,
                      const std::string& function);
analysis::Box box_of(const Shape& shape);
Region region_of(const Shape& shape);
// The shape of a box; nullopt if its bounds are not constants or it is too large to examine.
std::optional<Shape> constant_shape(const analysis::Box& box);

Buffer<> new_buffer(Type type, const Shape& shape);
// The elements of a buffer of floats of any width.
Values values_of(const Buffer<>& buffer);
void fill(Buffer<>& buffer, const Values& values);
// Takes the Func by reference, since it caches its compiled code, which a copy would not share.
Values realize(Func& f, const Shape& shape);
// One array for each value of the Func; empty for values that are not floats.
std::vector<Values> realize_values(Func& f, const Shape& shape);
// A Func that computes the values of `f` over the shape. If no Func of `f` has directives, it is a copy with
// the built-in schedule; reductions of reductions would otherwise be recomputed at each read.
Func scheduled_for(const Func& f, const Shape& shape);
// Runs many Funcs as one pipeline, so that common producers are compiled and computed once. Falls back to one
// run for each if that fails: if the Funcs together are very large, if one reads another outside of its
// shape, or if a Func that was inlined into one would have to be stored for two.
class Batch {
 public:
  void add(const Func& f, const Shape& shape);
  size_t size() const { return entries_.size(); }
  std::vector<std::vector<Values>> realize();  // the result of realize_values for each added Func

 private:
  struct Entry {
    Func func;
    Shape shape;
    size_t position;  // index of its first value among the outputs; a Func may be added twice
  };
  bool realize_together(std::vector<std::vector<Values>>& to);
  std::vector<Entry> entries_;
  std::vector<Func> outputs_;
  std::vector<Shape> shapes_;  // one for each output
  size_t values_ = 0;
  double elements_ = 0;
  bool together_ = true;
  Pipeline pipeline_;
};

bool is_checkable(Type type);         // whether it is a float
double held_by(Type type, double v);  // v rounded to float32 and to the type
// Coordinates of the i-th element of an array.
std::vector<int> place_of(size_t i, const Shape& shape);

// A floating input with its bound values, and its copy in double.
struct Input {
  std::shared_ptr<ParameterContents> own, wide;
  Shape shape;
  Values values;    // as bound when the check began
  Buffer<> buffer;  // bound to `wide`; undefined for scalars

  void set_wide(const Values& to);
  void set_own(const Values& to);  // rounds; writes into the buffer that the user bound
};
// Throws RuntimeError if the input is not bound; `asked` begins the message.
Input bind_wide(const std::shared_ptr<ParameterContents>& own,
                const std::shared_ptr<ParameterContents>& wide, const std::string& asked);

}  // namespace retrograde::checks
