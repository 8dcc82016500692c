// gradient.h -- gradients as programs: a generator derives them from a pipeline written as users do, without a
// schedule. Halide schedules them with Li2018, its autoscheduler for gradients; Retrograde uses its default schedule.
// With primal=true, the same function gives the sum whose gradients are taken, and zeros for the gradients, so that
// differences can check them.
#pragma once

#include <optional>

#include "program.h"

namespace programs {

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

// The adjoint of a pipeline's output: an input.
struct Seed {
  explicit Seed(const std::vector<int>& output_extents)
      : extents(output_extents), values("seed", static_cast<int>(extents.size())) {}

  std::vector<int> extents;
  Halide::GeneratorInput<Halide::Buffer<float>> values;
};

// An input of a pipeline, and its gradient: an output. The pipeline reads it like a Func.
class Variable {
 public:
  // The names of the input and of the Func of its values.
  Variable(const std::string& input_name, const std::string& func_name,
           const std::vector<int>& extents)
      : func_name_(func_name),
        extents_(extents),
        values_(input_name, static_cast<int>(extents.size())),
        gradient_("d_" + input_name, static_cast<int>(extents.size())) {}

  operator const Halide::Func&() { return func(); }
  template <typename... Indices>
  Halide::FuncRef operator()(const Indices&... indices) {
    return func()(indices...);
  }
  // Defines the gradient with respect to the Func.
  void set_gradient(const Weighed& weighed) {
    gradient_ = weighed.by(func());
    estimate(values_, extents_);
    estimate(gradient_, extents_);
  }

 private:
  // Defined when the pipeline first reads it: a generator's inputs have no values before.
  const Halide::Func& func() {
    if (func_) return *func_;
    std::vector<Halide::Var> vars;
    std::vector<Halide::Expr> at;
    for (size_t d = 0; d < extents_.size(); d++) vars.emplace_back("v" + std::to_string(d));
    for (const Halide::Var& v : vars) at.push_back(v);
    func_.emplace(func_name_);
    (*func_)(vars) = values_(at);
    return *func_;
  }

  std::string func_name_;
  std::vector<int> extents_;
  Halide::GeneratorInput<Halide::Buffer<float>> values_;
  Halide::GeneratorOutput<Halide::Buffer<float>> gradient_;
  std::optional<Halide::Func> func_;
};

// The base of a gradient's generator, whose members are the inputs of the pipeline (a Variable each, if it has a
// gradient), then the Seed. `generate` defines the pipeline and ends with `differentiate`.
template <typename T>
class GradientGenerator : public PictureGenerator<T> {
 public:
  using Seed = programs::Seed;
  using Variable = programs::Variable;
  Halide::GeneratorParam<bool> primal{"primal", false};
  Halide::GeneratorOutput<Halide::Buffer<double>> sum{"sum", 0};

 protected:
  // Without a schedule a program would be inlined into its output. Only the primal, which is for checks, is stored.
  void store(std::vector<Halide::Func> stages) {
    for (Halide::Func& f : stages) {
      if (primal) f.compute_root();
    }
  }
  // Defines all outputs, from the pipeline's output and the variables that it depends on.
  void differentiate(const Halide::Func& output, Seed& seed,
                     const std::vector<Variable*>& variables) {
    const Weighed weighed(output, seed.values, seed.extents, primal);
    sum() = weighed.sum();
    for (Variable* variable : variables) variable->set_gradient(weighed);
    estimate(seed.values, seed.extents);
    estimate(sum, {});
  }
};

// The one case of a gradient: the inputs of its pipeline, of which the arrays have gradients.
inline Registered gradients_of(const std::vector<Argument>& inputs,
                               const std::vector<int>& output_extents) {
  std::vector<Argument> arguments = inputs, gradients;
  for (const Argument& input : inputs) {
    if (input.role == Role::Input) gradients.push_back(out<float>(input.extents));
  }
  arguments.push_back(in<float>(output_extents, -1, 1).noise());
  arguments.push_back(out<double>({}));
  arguments.insert(arguments.end(), gradients.begin(), gradients.end());
  return at_sizes({{}}, [&](const Sizes&) { return arguments; })
      .gradients(static_cast<int>(gradients.size()));
}

}  // namespace programs
