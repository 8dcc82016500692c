// Autoscheduling of sums with a single pointwise consumer: they are computed in the consumer's
// tiles.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <functional>
#include <string>
#include <vector>

#include "graph/graph.h"
#include "ir/target.h"
#include "support/rules_schedule.h"

namespace retrograde {
namespace {

struct LayerSizes {
  int width = 70, height = 50, channels = 12, images = 3, kernel = 3;
};

// A convolution of several images, and its consumer.
struct Layer {
  using Reading = std::function<Expr(const Layer&)>;

  explicit Layer(const Reading& read, const LayerSizes& sizes = {}) : of(sizes) {
    fill(image, 0.5f);
    fill(weights, 0.02f);
    fill(bias, 0.1f);
    const Func padded = BoundaryConditions::constant_exterior(image, 0.0f);
    RDom r({{0, of.kernel}, {0, of.kernel}, {0, of.channels}}, "r");
    convolved(x, y, c, n) = bias(c);
    convolved(x, y, c, n) += weights(r.x, r.y, r.z, c) * padded(x + r.x - 1, y + r.y - 1, r.z, n);
    result(x, y, c, n) = read(*this);
    result.set_estimates({{0, of.width}, {0, of.height}, {0, of.channels}, {0, of.images}});
  }
  template <typename B>
  static void fill(B& buffer, float scale) {
    int at = 0;
    for (int i = 0; i < static_cast<int>(buffer.number_of_elements()); i++, at = (at * 7 + 5) % 31)
      buffer.data()[i] = scale * static_cast<float>(at - 15);
  }
  Expr here() const { return convolved(x, y, c, n); }
  const graph::LoopLevel& level() const { return convolved.function()->schedule.compute_level; }
  // Whether it is computed in the innermost of the loops over tiles.
  bool is_in_tiles() const {
    return level().kind == graph::LoopLevel::Kind::At && level().func == result.name() &&
           level().var == "x";
  }
  std::string schedule() { return schedule_by_rules(Pipeline(result)).to_cpp(); }
  Buffer<float> found(const std::vector<int>& sizes) { return result.realize(sizes); }

  LayerSizes of;
  Var x{"x"}, y{"y"}, c{"c"}, n{"n"};
  Buffer<float> image{of.width, of.height, of.channels, of.images};
  Buffer<float> weights{of.kernel, of.kernel, of.channels, of.channels}, bias{of.channels};
  Func convolved{"convolved"}, result{"result"};
};

void expect_same(const Buffer<float>& found, const Buffer<float>& expected, const std::string& of) {
  ASSERT_EQ(found.number_of_elements(), expected.number_of_elements());
  for (size_t i = 0; i < found.number_of_elements(); i++)
    ASSERT_NEAR(found.data()[i], expected.data()[i], 1e-4f) << of << ", element " << i;
}

Expr positive(const Layer& layer) { return max(layer.here(), 0.0f); }

TEST(Epilogues, AreComputedWithTheirTiles) {
  const std::vector<std::pair<std::string, Layer::Reading>> readings{
      {"activation", positive},
      {"with its input", [](const Layer& l) { return l.here() + l.image(l.x, l.y, l.c, l.n); }},
      {"smooth, of its place",
       [](const Layer& l) { return l.here() / (1.0f + exp(-l.here())) + l.x; }}};
  for (const auto& [name, read] : readings) {
    // LayerSizes: all vectors full; tails in every dimension; rows shorter than a vector.
    for (const LayerSizes& sizes :
         {LayerSizes{64, 48, 16, 2}, LayerSizes{70, 50, 11, 3}, LayerSizes{9, 50, 7, 5}}) {
      Layer layer(read, sizes), plain(read, sizes);
      layer.schedule();
      EXPECT_TRUE(layer.is_in_tiles()) << name;
      plain.convolved.compute_root();
      const std::vector<int> all{sizes.width, sizes.height, sizes.channels, sizes.images};
      expect_same(layer.found(all), plain.found(all), name);
      const std::vector<int> part{sizes.width / 2 + 1, 3, sizes.channels, 1};
      expect_same(layer.found(part), plain.found(part), name + ", a part");
    }
  }
}

TEST(Epilogues, ArePartOfTheSchedulesText) {
  Layer layer(positive);
  const std::string text = layer.schedule();
  for (const char* directive : {"convolved.compute_at(LoopLevel(result, x))",
                                "_in_convolved.compute_at(LoopLevel(result, y))"})
    EXPECT_NE(text.find(directive), std::string::npos) << directive << " in\n" << text;
}

// The chain ends in the output, or in a Func that long sums read.
TEST(Epilogues, OfASumOfFewTerms) {
  const LayerSizes few{.width = 70, .height = 50, .channels = 3};
  Layer layer(positive, few), plain(positive, few);
  layer.schedule();
  EXPECT_TRUE(layer.is_in_tiles());
  plain.convolved.compute_root();
  expect_same(layer.found({70, 50, 3, 3}), plain.found({70, 50, 3, 3}), "few terms");

  Layer first([](const Layer& l) { return l.here() / (1.0f + exp(-l.here())); }, few);
  Func second("second");
  RDom k(0, 3, 0, 12, "k");
  second(first.x, first.y, first.c, first.n) +=
      first.result(first.x, first.y, k.x, first.n) * cast<float>(k.y + first.c);
  second.set_estimates({{0, 60}, {0, 40}, {0, 3}, {0, 3}});
  schedule_by_rules(Pipeline(second));
  EXPECT_TRUE(first.is_in_tiles());
}

TEST(Epilogues, AreNotOfAFewTermsMore) {
  Layer layer(positive, {.width = 70, .height = 50, .channels = 1, .kernel = 2});
  layer.schedule();
  EXPECT_FALSE(layer.is_in_tiles());
}

// The whole program runs in strips.
TEST(Epilogues, AreNotOfSumsOfFewTermsBehindWhichAStencilGoesOn) {
  Layer layer(positive, {.width = 300, .height = 300, .channels = 3});
  Func edges("edges");
  edges(layer.x, layer.y, layer.c, layer.n) = layer.result(layer.x, layer.y + 1, layer.c, layer.n) -
                                              layer.result(layer.x, layer.y, layer.c, layer.n);
  edges.set_estimates({{0, 299}, {0, 299}, {0, 3}, {0, 3}});
  schedule_by_rules(Pipeline(edges));
  EXPECT_FALSE(layer.is_in_tiles());
  EXPECT_EQ(layer.level().func, edges.name());
}

// The row blur runs in strips with the column blur, which it reads.
TEST(Epilogues, AreNotOfStencilsThatReadWhatIsComputed) {
  Buffer<float> image(300, 300);
  Layer::fill(image, 0.5f);
  Var x("x"), y("y");
  RDom r(-20, 41);
  Func columns("columns"), rows("rows"), sharp("sharp");
  const Func padded = BoundaryConditions::mirror_image(image);
  columns(x, y) += padded(x, y + r) / 41;
  rows(x, y) += columns(x + r, y) / 41;
  sharp(x, y) = 2 * image(x, y) - rows(x, y);
  sharp.set_estimates({{0, 300}, {0, 300}});
  schedule_by_rules(Pipeline(sharp));
  const graph::LoopLevel& level = rows.function()->schedule.compute_level;
  EXPECT_FALSE(level.kind == graph::LoopLevel::Kind::At && level.var == "x");
}

TEST(Epilogues, AreNotOfOtherPlaces) {
  for (const auto& read : std::vector<Layer::Reading>{
           [](const Layer& l) { return l.here() + l.convolved(l.x, l.y + 1, l.c, l.n); },
           [](const Layer& l) { return l.convolved(l.x, l.y, l.n, l.c); }}) {
    Layer layer(read, {.channels = 12, .images = 12});
    layer.schedule();
    EXPECT_FALSE(layer.is_in_tiles());
  }
}

TEST(Epilogues, AreNotWhereTwoReadThem) {
  Layer layer(positive);
  Func other("other");
  other(layer.x, layer.y, layer.c, layer.n) = exp(layer.here());
  other.set_estimates({{0, 70}, {0, 50}, {0, 12}, {0, 3}});
  schedule_by_rules(Pipeline({layer.result, other}));
  EXPECT_EQ(layer.level().kind, graph::LoopLevel::Kind::Root);
}

// One of two sums is computed in the consumer's tiles; the consumer's loops are then fixed.
TEST(Epilogues, OfTwoSumsThatOneReads) {
  const auto both = [](Layer& layer) {
    Func second("second");
    RDom k(0, 5, 0, 12, "k");
    second(layer.x, layer.y, layer.c, layer.n) +=
        layer.weights(k.x % 3, 1, k.y, layer.c) *
        layer.image(clamp(layer.x + k.x, 0, 69), layer.y, k.y, layer.n);
    Func product("product");
    product(layer.x, layer.y, layer.c, layer.n) =
        layer.here() * second(layer.x, layer.y, layer.c, layer.n);
    product.set_estimates({{0, 70}, {0, 50}, {0, 12}, {0, 3}});
    return product;
  };
  Layer layer(positive), plain(positive);
  Func found = both(layer), expected = both(plain);
  schedule_by_rules(Pipeline(found));
  expect_same(found.realize({70, 50, 12, 3}), expected.realize({70, 50, 12, 3}), "product");
}

TEST(Epilogues, OfAProductOfMatrices) {
  const int n = 150;
  Buffer<float> a(n, n), b(n, n), bias(n);
  for (Buffer<float>* each : {&a, &b}) Layer::fill(*each, 0.1f);
  Layer::fill(bias, 1.0f);
  const auto product_of = [&](Func& product) {
    Var x("x"), y("y");
    RDom k(0, n, "k");
    Func result("result");
    product(x, y) += a(k, y) * b(x, k);
    result(x, y) = max(product(x, y) + bias(x), 0.0f);
    result.set_estimates({{0, n}, {0, n}});
    return result;
  };
  Func product("product"), plain("product");
  Func found = product_of(product), expected = product_of(plain);
  schedule_by_rules(Pipeline(found));
  plain.compute_root();
  expect_same(found.realize({n, n}), expected.realize({n, n}), "product");
}

// The gradient by an image is that of the padded image, inside the image.
TEST(Epilogues, AreThoseOfAGradientThroughABoundaryCondition) {
  Layer layer(positive), plain(positive);
  const auto gradient = [](Layer& of) {
    RDom all({{0, of.of.width}, {0, of.of.height}, {0, of.of.channels}, {0, of.of.images}}, "all");
    Func loss("loss");
    loss() = 0.0f;
    loss() += 0.5f * of.result(all[0], all[1], all[2], all[3]) *
              of.result(all[0], all[1], all[2], all[3]);
    Func result = propagate_adjoints(loss)(of.image);
    result.set_estimates(
        {{0, of.of.width}, {0, of.of.height}, {0, of.of.channels}, {0, of.of.images}});
    return result;
  };
  Func found = gradient(layer), expected = gradient(plain);
  schedule_by_rules(Pipeline(found));
  int in_tiles = 0;
  for (const graph::FuncPtr& f : graph::topological_order({found.function()}))
    in_tiles += f->schedule.compute_level.func == found.name() &&
                f->schedule.compute_level.var == found.args()[0].name();
  EXPECT_EQ(in_tiles, 1);
  for (const graph::FuncPtr& f : graph::topological_order({expected.function()}))
    Func(f).compute_root();
  const std::vector<int> sizes{70, 50, 12, 3};
  expect_same(found.realize(sizes), expected.realize(sizes), "gradient");
}

}  // namespace
}  // namespace retrograde
