// evaluator.h -- the model compiled: loss, gradient and Hessian-vector products at points in double.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "pipeline.h"

namespace lens {

class Evaluator {
 public:
  // `real`: Float(64), or Float(32), which all values are then rounded to.
  Evaluator(const Scene& scene, retrograde::Type real);

  void set_goal(double length_mm);

  double loss(std::span<const double> x, std::span<double> gradient);
  void hessian_product(std::span<const double> x, std::span<const double> v,
                       std::span<double> product);

  // Compiles the product, which hessian_product does when it is first asked for. Seconds.
  double compile_product();

  // What the gradient is made of (Derivative::explain), and its operations over those of the loss.
  std::string explain() const { return adjoints_.explain(); }
  retrograde::GradientOperations operations() const { return adjoints_.operations(); }
  double compile_seconds() const { return compile_seconds_; }
  LensModel& model() { return model_; }

 private:
  template <typename T>
  void bind(retrograde::ImageParam& to, std::span<const double> values);
  void bind_any(retrograde::ImageParam& to, std::span<const double> values);
  template <typename T>
  double loss_of(std::span<double> gradient);
  template <typename T>
  void product_of(std::span<double> product);

  retrograde::Type real_;
  LensModel model_;
  retrograde::Derivative adjoints_;
  retrograde::ImageParam direction_;
  retrograde::Pipeline both_;
  retrograde::Func product_;
  bool has_product_ = false;
  double compile_seconds_ = 0;
};

}  // namespace lens
