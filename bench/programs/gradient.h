// gradient.h -- gradients as programs: a generator derives them from a pipeline written as users do, without a
// schedule. Halide schedules them with Li2018, its autoscheduler for gradients; Retrograde uses its default schedule.
// With primal=true, the same function gives the sum whose gradients are taken, and zeros for the gradients, so that
// differences can check them.
#pragma once

#include "program.h"

namespace programs {

// The values of an input, as a Func with respect to which gradients are taken.
template <typename Image>
Halide::Func values_of(Image& image, const std::string& name, const std::vector<int>& extents) {
  std::vector<Halide::Var> vars;
  std::vector<Halide::Expr> at;
  for (size_t d = 0; d < extents.size(); d++) vars.emplace_back("v" + std::to_string(d));
  for (const Halide::Var& v : vars) at.push_back(v);
  Halide::Func f(name);
  f(vars) = image(at);
  return f;
}

// f at a position, clamped to its extents.
inline Halide::Expr nearest(const Halide::Func& f, const std::vector<int>& extents,
                            std::vector<Halide::Expr> at) {
  for (size_t d = 0; d < extents.size(); d++) at[d] = clamp(at[d], 0, extents[d] - 1);
  return f(at);
}

// The sum of seed * output over [0, extents), and its gradients.
class Weighed {
 public:
  Weighed(Halide::Func output, Halide::Func seed, const std::vector<int>& extents, bool is_primal)
      : is_primal_(is_primal) {
    Halide::Region region;
    for (int extent : extents) region.push_back({0, extent});
    Halide::RDom r(region, "pixels");
    std::vector<Halide::Expr> at;
    for (size_t d = 0; d < extents.size(); d++) at.push_back(r[static_cast<int>(d)]);
    Halide::Expr term = output(at) * seed(at);
    if (is_primal) {
      sum_() += Halide::cast<double>(term);
      return;
    }
    loss_() += term;
    gradients_ = std::make_shared<Halide::Derivative>(Halide::propagate_adjoints(loss_));
  }

  Halide::Expr sum() const { return is_primal_ ? Halide::Expr(sum_()) : Halide::Expr(0.0); }
  Halide::Func by(Halide::Func input) const {
    if (!is_primal_) return (*gradients_)(input);
    Halide::Func zero;
    zero(input.args()) = 0.0f;
    return zero;
  }

 private:
  bool is_primal_;
  Halide::Func sum_{"sum"}, loss_{"loss"};
  std::shared_ptr<Halide::Derivative> gradients_;
};

// The usual sizes, for the autoscheduler.
template <typename Image>
void estimate(Image& image, const std::vector<int>& extents) {
  Halide::Region region;
  for (int extent : extents) region.push_back({0, extent});
  image.set_estimates(region);
}

// Without a schedule a program would be inlined into its output. Only the primal, which is for checks, is stored.
inline void store(std::vector<Halide::Func> stages, bool is_primal) {
  for (Halide::Func& f : stages) {
    if (is_primal) f.compute_root();
  }
}

}  // namespace programs
