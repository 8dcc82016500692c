// Tests custom_adjoint on extern stages whose adjoints are extern stages too. C functions compute both in machine code;
// the expected values come from the same program written with ordinary Funcs. Also tests second derivatives by rules of
// the adjoint stage, and refusals where there is no rule.
#include <HalideRuntime.h>

#include "autodiff/custom_derivative.h"
#include "autodiff/tangents.h"
#include "frontend/data/param.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"

#define EXPORTED extern "C" __attribute__((visibility("default")))

namespace {
bool is_query(const halide_buffer_t* b) { return !b->host && !b->device; }
float& element(halide_buffer_t* b, int x) {
  return reinterpret_cast<float*>(b->host)[int64_t{x - b->dim[0].min} * b->dim[0].stride];
}
void require(halide_buffer_t* b, int min, int max) {
  b->dim[0].min = min;
  b->dim[0].extent = max - min + 1;
}
int first(const halide_buffer_t* b) { return b->dim[0].min; }
int last(const halide_buffer_t* b) { return b->dim[0].min + b->dim[0].extent - 1; }
}  // namespace

// out(x) = in(x)^2 + in(x - 1) / 2
EXPORTED int custom_extern_step(halide_buffer_t* in, halide_buffer_t* out) {
  if (is_query(in)) {
    require(in, first(out) - 1, last(out));
    return 0;
  }
  for (int x = first(out); x <= last(out); ++x)
    element(out, x) = element(in, x) * element(in, x) + element(in, x - 1) / 2;
  return 0;
}

// in_adj(x) = 2 in(x) out_adj(x) + out_adj(x + 1) / 2
EXPORTED int custom_extern_step_adj(halide_buffer_t* in, halide_buffer_t* out_adj,
                                    halide_buffer_t* in_adj) {
  if (is_query(in) || is_query(out_adj)) {
    if (is_query(in)) require(in, first(in_adj), last(in_adj));
    if (is_query(out_adj)) require(out_adj, first(in_adj), last(in_adj) + 1);
    return 0;
  }
  for (int x = first(in_adj); x <= last(in_adj); ++x)
    element(in_adj, x) = 2 * element(in, x) * element(out_adj, x) + element(out_adj, x + 1) / 2;
  return 0;
}

// Both values of a Tuple: the square and the cube, times a scalar.
EXPORTED int custom_extern_powers(halide_buffer_t* in, float scale, halide_buffer_t* square,
                                  halide_buffer_t* cube) {
  if (is_query(in)) {
    require(in, first(square), last(square));
    return 0;
  }
  for (int x = first(square); x <= last(square); ++x) {
    float v = element(in, x);
    element(square, x) = scale * v * v;
    element(cube, x) = scale * v * v * v;
  }
  return 0;
}

namespace retrograde::gradient {
namespace {

using Contributions = std::vector<AdjointContribution>;

class CustomExternStages : public ::testing::Test {
 protected:
  static constexpr int size = 20;
  Var x{"x"};
  Buffer<float> a = random_image({size}, 0.25, 1.5, 1), w = random_image({size}, -1, 1, 2);
  Func g{"g"};

  // The Func that the stages read: a function of the image, defined everywhere.
  CustomExternStages() {
    g(x) = sin(a(clamp(x, 0, size - 1))) * 2.0f;
    g.compute_root();
  }
  Func stage_of(const Func& in) {
    Func f("step");
    f.define_extern("custom_extern_step", {in}, Float(32), {x});
    f.compute_root();
    return f;
  }
  Func twin_of(const Func& in) {
    Func f("twin");
    f(x) = in(x)*in(x) + in(x - 1) / 2.0f;
    f.compute_root();
    return f;
  }
  static Region reads(const AdjointInput&, const Region& r) {
    return {{r[0].min - 1, r[0].extent + 1}};
  }
  static void give_rule(const Func& f, const Func& in) {
    custom_adjoint(
        f, {in},
        [in](const AdjointContext& c) {
          Func adj("step_adj"), out_adj = c.adjoint();
          out_adj.compute_root();
          adj.define_extern("custom_extern_step_adj", {in, out_adj}, Float(32), {Var("i")});
          adj.compute_root();
          give_rule_of_adjoint(adj, in, out_adj);
          return Contributions{{in, adj}};
        },
        reads);
  }
  // in_adj(x) = 2 in(x) out_adj(x) + out_adj(x + 1) / 2 is bilinear; its rule uses ordinary Funcs.
  static void give_rule_of_adjoint(const Func& adj, const Func& in, const Func& out_adj) {
    custom_adjoint(
        adj, {in, out_adj},
        [in, out_adj](const AdjointContext& c) {
          Func to_in("to_in"), to_adj("to_adj");
          Var i("i");
          to_in(i) = 2.0f * out_adj(i) * c.adjoint()(i);
          to_adj(i) = 2.0f * in(i)*c.adjoint()(i) + c.adjoint()(i - 1) / 2.0f;
          return Contributions{{in, to_in}, {out_adj, to_adj}};
        },
        ExternReads([](const AdjointInput&, const Region& r) -> Region {
          return {{r[0].min, r[0].extent + 1}};
        }));
  }
  Func weighed(const Func& f) {
    Func loss("loss");
    RDom r(0, size);
    loss() = 0.0f;
    loss() += f(r) * f(r) * w(r);
    return loss;
  }
  void expect_same(Func found, Func expected, double tolerance = 2e-5) {
    Buffer<float> left = found.realize({size}), right = expected.realize({size});
    double scale = 0;
    for (int n = 0; n < size; ++n) scale = std::max(scale, std::abs(1.0 * right(n)));
    EXPECT_GT(scale, 0.1);
    for (int n = 0; n < size; ++n) EXPECT_NEAR(left(n), right(n), tolerance * scale) << n;
  }
};

TEST_F(CustomExternStages, HaveExternAdjoints) {
  Func f = stage_of(g);
  give_rule(f, g);
  expect_same(propagate_adjoints(weighed(f))(a), propagate_adjoints(weighed(twin_of(g)))(a));
}

TEST_F(CustomExternStages, InAChain) {
  Func f1 = stage_of(g), f2 = stage_of(f1);
  give_rule(f1, g);
  give_rule(f2, f1);
  expect_same(propagate_adjoints(weighed(f2))(a),
              propagate_adjoints(weighed(twin_of(twin_of(g))))(a));
}

TEST_F(CustomExternStages, DifferentiateTwice) {
  auto second = [&](const Func& f) {
    Func along("along"), gradient = propagate_adjoints(weighed(f), {.wrt = {a}})(a);
    RDom r(0, size);
    along() = 0.0f;
    along() += gradient(r) * cast<float>(r % 3);
    return propagate_adjoints(along, {.wrt = {a}})(a);
  };
  Func f = stage_of(g);
  give_rule(f, g);
  expect_same(second(f), second(twin_of(g)));
}

TEST_F(CustomExternStages, OfImagesScalarsAndTuples) {
  Param<float> scale("scale");
  scale.set(0.75f);
  Func f("powers"), twin("twin"), h("h"), k("k");
  f.define_extern("custom_extern_powers", {a, scale}, {Float(32), Float(32)}, {x});
  f.compute_root();
  twin(x) = Tuple(scale * a(x) * a(x), scale * a(x) * a(x) * a(x));
  Buffer<float> in = a;
  custom_adjoint(f, {a, scale}, [in, scale](const AdjointContext& c) {
    Func adj("adj"), scale_adj("scale_adj"), y = c.adjoint();
    Var i("i");
    adj(i) = scale * (2.0f * in(i)*y(i)[0] + 3.0f * in(i)*in(i)*y(i)[1]);
    RDom r(c.region());
    scale_adj() = 0.0f;
    scale_adj() += y(r)[0] * in(r)*in(r) + y(r)[1] * in(r)*in(r)*in(r);
    return Contributions{{in, adj}, {scale, scale_adj}};
  });
  h(x) = f(x)[0] * f(x)[1];
  k(x) = twin(x)[0] * twin(x)[1];
  Derivative found = propagate_adjoints(weighed(h)), expected = propagate_adjoints(weighed(k));
  expect_same(found(a), expected(a));
  Buffer<float> left = found(scale).realize(), right = expected(scale).realize();
  EXPECT_NEAR(left(), right(), 1e-4 * std::abs(right()));
}

TEST_F(CustomExternStages, WithoutARuleAreRefusedOnTheWayOnly) {
  Func f = stage_of(g), h("h");
  h(x) = f(x) * w(x);
  expect_error<Unsupported>({"differentiate", "custom_extern_step", "custom_adjoint"},
                            [&] { propagate_adjoints(weighed(h), {.wrt = {a}}); });
  Func twin("h");
  twin(x) = twin_of(g)(x) * w(x);
  expect_same(propagate_adjoints(weighed(h), {.wrt = {w}})(w),
              propagate_adjoints(weighed(twin), {.wrt = {w}})(w));
}

// rule: every variable needs a range
TEST_F(CustomExternStages, SumsOverAnArgumentNeedItsRegion) {
  Func f = stage_of(g);
  custom_adjoint(f, {g}, [this](const AdjointContext& c) {
    return Contributions{{g, c.adjoint()}};
  });
  expect_error({"unbounded domain"}, [&] { propagate_adjoints(weighed(f)); });
  custom_adjoint(
      f, {g},
      [this](const AdjointContext& c) {
        return Contributions{{g, c.adjoint()}};
      },
      [](const AdjointInput&, const Region&) {
        return Region{{0, 1}, {0, 1}};
      });
  expect_error({"each dimension of the argument", "2 dimensions instead of 1"},
               [&] { propagate_adjoints(weighed(f)); });
}

TEST_F(CustomExternStages, HaveTangents) {
  Func f = stage_of(g), twin = twin_of(g);
  custom_tangent(f, {g}, [this](const TangentContext& c) {
    Func tan("tan");
    Var i("i");
    tan(i) = 2.0f * g(i) * c.tangent(g)(i) + c.tangent(g)(i - 1) / 2.0f;
    return tan;
  });
  Func v("v");
  v(x) = w(clamp(x, 0, size - 1));
  expect_same(propagate_tangents(f, {{a, v}})(f), propagate_tangents(twin, {{a, v}})(twin));
}

}  // namespace
}  // namespace retrograde::gradient
