// gradient_matrix_product -- the product of two matrices. Gradients: both.
#include "gradient.h"

namespace {

class GradientMatrixProduct : public Halide::Generator<GradientMatrixProduct> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> a{"a", 2};
  Input<Buffer<float>> b{"b", 2};
  Input<Buffer<float>> seed{"seed", 2};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_a{"d_a", 2};
  Output<Buffer<float>> d_b{"d_b", 2};

  void generate() {
    Func left = programs::values_of(a, "left", {192, 160});
    Func right = programs::values_of(b, "right", {128, 192});

    RDom k(0, 192, "k");
    Func product("product");
    product(x, y) += left(k, y) * right(x, k);
    programs::Weighed weighed(product, seed, {128, 160}, primal);
    sum() = weighed.sum();
    d_a = weighed.by(left);
    programs::estimate(a, {192, 160});
    programs::estimate(d_a, {192, 160});
    d_b = weighed.by(right);
    programs::estimate(b, {128, 192});
    programs::estimate(d_b, {128, 192});
    programs::estimate(seed, {128, 160});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_matrix_product, GradientMatrixProduct, at_sizes({{}}, [](const Sizes&) {
                                                          return std::vector{
                                                              in<float>({192, 160}, -1, 1).noise(),
                                                              in<float>({128, 192}, -1, 1).noise(),
                                                              in<float>({128, 160}, -1, 1).noise(),
                                                              out<double>({}),
                                                              out<float>({192, 160}),
                                                              out<float>({128, 192})};
                                                        }).gradients(2))
