// attention -- causal attention with several heads: each row mixes the value's previous rows, weighted by a softmax.
// Gradients: query, key and value. Source: Vaswani et al., Attention Is All You Need, NeurIPS 2017, section 3.2.
#include "operator.h"

namespace kernels {

Kernel attention(const Setup& setup) {
  const int features = setup.size(64, 8), rows = setup.size(512, 21), heads = setup.size(8, 2);
  const Buffer<real> query = make_noise({features, rows, heads}, 1);
  const Buffer<real> key = make_noise({features, rows, heads}, 2);
  const Buffer<real> value = make_noise({features, rows, heads}, 3);
  Var d("d"), i("i"), j("j"), h("h");
  RDom f(0, features), k(0, rows);
  Func product("product"), score("score"), most("most"), weight("weight"), sum("sum");
  Func mixed("mixed"), attended("attended");
  product(j, i, h) = real(0);
  product(j, i, h) += query(f, i, h) * key(f, j, h);
  score(j, i, h) =
      select(j <= i, product(j, i, h) / std::sqrt(static_cast<float>(features)), real(-1e9));
  most(i, h) = real(-1e9);
  most(i, h) = max(most(i, h), score(k, i, h));
#ifdef BENCH_RETROGRADE
  weight(j, i, h) = exp(score(j, i, h) - most(i, h));
#else  // Halide has no gradient of a maximum; these scores need no shift
  weight(j, i, h) = exp(score(j, i, h));
#endif
  sum(i, h) = real(0);
  sum(i, h) += weight(k, i, h);
  mixed(d, i, h) = real(0);
  mixed(d, i, h) += weight(k, i, h) * value(d, k, h);
  attended(d, i, h) = mixed(d, i, h) / sum(i, h);
  const double products = 0.5 * rows * (rows + 1.0) * features * heads;  // per matrix product
  return gradients_of(setup, attended, {features, rows, heads}, {query, key, value},
                      6 * 2 * products);
}

}  // namespace kernels
