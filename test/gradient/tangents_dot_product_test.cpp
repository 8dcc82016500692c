// Forward against reverse mode over random programs: <J v, w> = <v, J^T w>.
//
// Neither side is the oracle of the other alone; that the two transposes agree, found by inverting
// accesses and by walking stages in order, leaves an error in a partial, which
// derivative_rules_test excludes. In double by the interpreter to 1e-12, in float32 as machine code
// to 1e-5, both relative to the sum of the magnitudes of the terms.
#include "autodiff/tangents.h"
#include "gradient/random_program.h"

namespace retrograde::gradient {
namespace {

#ifdef RETROGRADE_MANY_PROGRAMS
constexpr unsigned programs_per_shard = 100, shards = 12, programs_as_machine_code = 100;
#else
constexpr unsigned programs_per_shard = 15, shards = 4, programs_as_machine_code = 4;
#endif

struct Product {
  double sum = 0, magnitude = 0;
  void add(double a, double b) {
    sum += a * b;
    magnitude += std::abs(a * b);
  }
};

Product dot(const oracle::Array& a, const Buffer<float>& b) {
  Product result;
  size_t i = 0;
  b.get()->for_each_value([&](const float& v) { result.add(a.values[i++].scalar.as_double(), v); });
  return result;
}
Product dot(const Buffer<float>& a, const Buffer<float>& b) {
  Product result;
  b.get()->for_each_element([&](const int* at) { result.add((*a.get())(at), (*b.get())(at)); });
  return result;
}

struct Case {
  RandomProgram program;
  Buffer<float> v, w;  // directions of the image and of the output
  Func forward, reverse;

  explicit Case(unsigned seed)
      : program(seed),
        v(random_image({size, size}, -1, 1, seed + 1)),
        w(random_image({size, size}, -1, 1, seed + 2)) {
    const Func& output = program.output();
    reverse = propagate_adjoints(output, w, {.overwritten = Overwritten::Store})(program.image);
    forward = propagate_tangents(output, {{program.image, v}})(output);
  }
};

void expect_equal(const Product& a, const Product& b, double tolerance) {
  EXPECT_NEAR(a.sum, b.sum, tolerance * (a.magnitude + b.magnitude + 1));
}

class DotProducts : public ::testing::TestWithParam<unsigned> {};

TEST_P(DotProducts, ForwardAgreesWithReverse) {
  unsigned refused = 0;
  for (unsigned i = 0; i < programs_per_shard; ++i) {
    const unsigned seed = GetParam() * programs_per_shard + i + 1000;
    SCOPED_TRACE("seed " + std::to_string(seed));
    try {
      Case c(seed);
      const oracle::Region all{{0, 0}, {size, size}};
      expect_equal(dot(evaluate(c.forward, all), c.w), dot(evaluate(c.reverse, all), c.v), 1e-12);
      if (i >= programs_as_machine_code) continue;
      Buffer<float> jv = c.forward.realize({size, size}), jtw = c.reverse.realize({size, size});
      expect_equal(dot(jv, c.w), dot(jtw, c.v), 1e-5);
    } catch (const Unsupported&) {
      ++refused;
    }
  }
  EXPECT_LE(refused, programs_per_shard / 5);
}

INSTANTIATE_TEST_SUITE_P(Shard, DotProducts, ::testing::Range(0u, shards));

}  // namespace
}  // namespace retrograde::gradient
