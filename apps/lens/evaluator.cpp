// evaluator.cpp -- see evaluator.h.
#include "evaluator.h"

#include <algorithm>
#include <chrono>

namespace lens {

using namespace retrograde;

Evaluator::Evaluator(const Scene& scene, Type real)
    : real_(real),
      model_(scene, real),
      adjoints_(propagate_adjoints(model_.loss, AdjointOptions{.wrt = {model_.variables}})),
      direction_(real, 1, "direction"),
      both_({model_.loss, adjoints_(model_.variables)}) {
  const auto start = std::chrono::steady_clock::now();
  set_goal(scene.lens.length());
  both_.compile_jit();
  compile_seconds_ =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <typename T>
void Evaluator::bind(ImageParam& to, std::span<const double> values) {
  Buffer<T> buffer(static_cast<int>(values.size()));
  for (size_t n = 0; n < values.size(); ++n)
    buffer(static_cast<int>(n)) = static_cast<T>(values[n]);
  to.set(buffer);
}

void Evaluator::bind_any(ImageParam& to, std::span<const double> values) {
  if (real_.bits() == 64)
    bind<double>(to, values);
  else
    bind<float>(to, values);
}

void Evaluator::set_goal(double length_mm) { bind_any(model_.goal, {&length_mm, 1}); }

template <typename T>
double Evaluator::loss_of(std::span<double> gradient) {
  Buffer<T> loss = Buffer<T>::make_scalar();
  if (gradient.empty()) {
    model_.loss.realize(loss);
    return static_cast<double>(loss());
  }
  Buffer<T> g(static_cast<int>(gradient.size()));
  both_.realize({loss, g});
  std::copy(g.begin(), g.end(), gradient.begin());
  return static_cast<double>(loss());
}

double Evaluator::loss(std::span<const double> x, std::span<double> gradient) {
  bind_any(model_.variables, x);
  return real_.bits() == 64 ? loss_of<double>(gradient) : loss_of<float>(gradient);
}

template <typename T>
void Evaluator::product_of(std::span<double> product) {
  const Buffer<T> out = product_.realize({static_cast<int>(product.size())});
  std::copy(out.begin(), out.end(), product.begin());
}

double Evaluator::compile_product() {
  if (has_product_) return 0;
  const auto start = std::chrono::steady_clock::now();
  Var i("i");
  Func along("along");
  along(i) = direction_(i);
  product_ = hessian_vector_product(model_.loss, model_.variables, {{model_.variables, along}});
  product_.compile_jit();
  has_product_ = true;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void Evaluator::hessian_product(std::span<const double> x, std::span<const double> v,
                                std::span<double> product) {
  compile_product();
  bind_any(model_.variables, x);
  bind_any(direction_, v);
  if (real_.bits() == 64)
    product_of<double>(product);
  else
    product_of<float>(product);
}

}  // namespace lens
