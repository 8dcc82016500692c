// matrix_multiply -- C = A B in single precision; element (i, j) is column i of row j.
//
// Blocks of C, 4 vectors wide and 6 rows high, stay in registers for all of k. B is packed into panels of that width,
// which the inner loop streams from the second-level cache.
#include "kernel.h"

namespace kernels {

Kernel matrix_multiply(const Setup& setup) {
  const int n = setup.size(1024, 128);
  const int lanes = setup.lanes<float>(), panel = 4 * lanes, rows = 6;
  ImageParam a(Float(32), 2, "a"), b(Float(32), 2, "b");
  Var i("i"), j("j"), k("k"), p("p"), io("io"), jo("jo"), ii("ii"), ji("ji"), iv("iv");

  Func product("product"), result("result");
  RDom r(0, n);
  if (setup.by_hand()) {
    Func packed("packed");
    packed(i, k, p) = b(p * panel + i, k);
    product(i, j, p) = 0.0f;
    product(i, j, p) += a(r, j) * packed(i, r, p);
    result(i, j) = product(i % panel, j, i / panel);

    result.bound(i, 0, n).bound(j, 0, n);
    result.tile(i, j, io, jo, ii, ji, panel, rows).reorder(ii, ji, jo, io).parallel(io);
    result.split(ii, ii, iv, lanes).vectorize(iv).unroll(ii).unroll(ji);
    product.bound(i, 0, panel).compute_at(result, jo);
    product.split(i, i, iv, lanes).vectorize(iv).unroll(i).unroll(j);
    product.update().split(i, i, iv, lanes).reorder(iv, i, j, r).vectorize(iv).unroll(i).unroll(j);
    packed.compute_root().bound(i, 0, panel).parallel(p).vectorize(i, lanes);
  } else {
    product(i, j) += a(r, j) * b(i, r);
    result(i, j) = product(i, j);
  }

  Buffer<float> first = make_image<float>({n, n}), second = make_image<float>({n, n});
  bind(a, first);
  bind(b, second);
  Buffer<float> c(n, n);
  return {Pipeline(result), {first, second}, {c}, 2.0 * n * n * n};
}

}  // namespace kernels
