// The helpers that all checks of one program share: evaluation in double, random weights, perturbed inputs.
#pragma once

#include <ctime>
#include <random>

#include "autodiff/tangents.h"
#include "diagnostics/error.h"
#include "gradient/adversary/check.h"

namespace retrograde::gradient {

// Limits for one Func and for one evaluation; larger programs are skipped.
constexpr size_t max_points = size_t{1} << 17;
constexpr uint64_t max_operations = 20'000'000;

// An exception that ends the judgement.
struct Verdict {
  Judged judged;
};
[[noreturn]] void decide(Judgement judgement, const std::string& detail);
// Judges the compiler as broken if the error reports an access outside of its own memory (Target::CheckedAccesses).
void decide_by_access(const UserError& error);

// The sum of a * b, and the sum of its magnitudes.
struct Product {
  double sum = 0, magnitude = 0;
  void add(double a, double b);
  void add(const Product& other);
  bool is_finite() const;
};

// Weights of all values of a box, from 1/4 to 7/4 and of either sign. No two are equal, so that the kinks of two
// elements do not cancel.
class Weights {
 public:
  explicit Weights(uint64_t seed) : random_(seed) {}
  float next() { return sign() * (0.25f + 1.5f * static_cast<float>(random_() >> 40) * 0x1p-24f); }
  float sign() { return random_() % 2 ? 1.0f : -1.0f; }
  int below(int n) { return static_cast<int>(random_() % static_cast<uint64_t>(n)); }
  Buffer<float> over(const oracle::Region& region, const std::string& name);
  Buffer<float> signs_over(const oracle::Region& region, const std::string& name);

 private:
  std::mt19937_64 random_;
};

double as_double(const oracle::Value& v);
double element(const Buffer<float>& buffer, const std::vector<int>& at);

// Both evaluate in double. `evaluate` is for generated Funcs: if the program can be evaluated, its derivative must be,
// or it is judged wrong.
std::vector<oracle::Array> interpret(const Func& f, const oracle::Region& region);
std::vector<oracle::Array> evaluate(const Func& f, const oracle::Region& region);

// The sum of weights * values of a Func over a region; integers count as 0.
Product weighted(const std::vector<oracle::Array>& arrays, const oracle::Region& region,
                 const std::vector<Buffer<float>>& weights);

// A Func that reads one buffer for each value; outside of the region it is `outside`.
Func reading(const std::vector<Buffer<float>>& buffers, const std::string& name);
Func reading_inside(const std::vector<Buffer<float>>& buffers, const oracle::Region& region,
                    float outside);

// All inputs of a program, and the step of each of their elements: +1 or -1.
class Motion {
 public:
  Motion(const AdversaryProgram& program, Weights& weights, const std::string& name);
  Motion operator+(const Motion& other) const;
  std::vector<AdjointInput> inputs() const;
  std::vector<Direction> directions() const;
  oracle::Region region(
      size_t input) const;  // the region of input i; empty for `scale`, the last one
  void move(double by) const;
  // <gradients, directions>; `of` gives the gradient by an input, undefined where there is none.
  Product along(const std::function<Func(const AdjointInput&)>& of) const;

 private:
  const AdversaryProgram& p_;
  std::vector<Buffer<float>> v_;
  float of_scale_;
};

// One output and the seed of its gradient.
struct SeededOutput {
  Func output;
  oracle::Region region;
  std::vector<Buffer<float>> w;  // one for each value of the output
  Func seed;
  Region bounds() const;
};

// One program and the seeds of its gradient.
struct Subject {
  const AdversaryProgram& program;
  Weights weights;
  std::vector<SeededOutput> outputs = {};
  double largest = 0;  // the largest sum of magnitudes in the primal
  std::clock_t begun = std::clock();
  const SeededOutput& first() const { return outputs.front(); }
  // The sum over all outputs of `of`.
  Product total(const std::function<Product(const SeededOutput&)>& of) const;
  std::vector<OutputAdjoint> adjoints() const;
  AdjointOptions options() const;  // options that request gradients by inputs only
  // The interpreter has already taken long: expensive checks that have not begun are skipped.
  bool is_late() const;
};

// ---- differences ----

// Whether a sine may turn within one step of the differences, given the sum of slopes along the direction. Differences
// see such a sine as noise, whatever its derivative is. (Found with sin(9^8 x).)
bool turns_within_a_step(const std::vector<Func>& outputs, double slope);

// The slope of f at 0, by sixth-order central differences. is_smooth: one-sided slopes agree.
struct Slope {
  double value, doubt;
  bool is_smooth;
};
// `scale`: of rounding errors, relative to 1e-6. f gives its value at a point.
Slope slope_of(const std::function<double(double)>& f, double at_rest, double scale, double largest,
               double precision);
// The precision of the narrowest floats of a program. Partials have that precision, even if they are computed in
// double.
double precision_of(const std::vector<Func>& outputs);

// ---- machine code ----

Buffer<> room_for(const Type& type, const oracle::Region& region);
// Fast functions are approximations, which stay finite where the exact functions have long overflowed.
bool uses_fast_functions(const Func& output);
bool is_finite(const oracle::Array& values);

// ---- the checks ----

void compare_higher(Subject& s, const Motion& v, const Derivative& derivative);
void compare_dense(Subject& s);
// The gradient by each input; undefined if the input is not read.
using Gradients = std::vector<std::pair<Func, oracle::Region>>;
// Returns the number of gradients that also have machine code under a random schedule; -1: the program itself does not
// run as machine code. twin: null, or the same program
// with an extern stage.
int compare_machine_code(Subject& s, const Derivative& derivative, const Gradients& gradients,
                         const AdversaryProgram* twin);

}  // namespace retrograde::gradient
