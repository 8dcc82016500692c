// evaluator.h -- the compiled model: loss, gradient and Hessian-vector products at points in double.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "pipeline.h"

namespace lens {

class Evaluator {
 public:
  // `real`: the type to compute in, Float(64) or Float(32), to which all values are then rounded.
  Evaluator(const Scene& scene, retrograde::Type real);

  void set_goal(double length_mm);

  double loss(std::span<const double> x, std::span<double> gradient);
  void hessian_product(std::span<const double> x, std::span<const double> v,
                       std::span<double> product);

  // Compiles the Hessian-vector product, which hessian_product would otherwise do on its first call. Returns seconds.
  double compile_product();

  // The gradient's stages (Derivative::explain), and its operations compared with those of the loss.
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
