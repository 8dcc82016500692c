// gradient_matrix_product -- the product of two matrices. Gradients: both.
#include "gradient.h"

namespace {

struct GradientMatrixProduct : programs::GradientGenerator<GradientMatrixProduct> {
  Variable left{"a", "left", {192, 160}}, right{"b", "right", {128, 192}};
  Seed seed{{128, 160}};

  void generate() {
    RDom k(0, 192, "k");
    Func product("product");
    product(x, y) += left(k, y) * right(x, k);
    differentiate(product, seed, {&left, &right});
  }
};

}  // namespace

PROGRAM(gradient_matrix_product, GradientMatrixProduct,
        gradients_of({in<float>({192, 160}, -1, 1).noise(), in<float>({128, 192}, -1, 1).noise()},
                     {128, 160}))
