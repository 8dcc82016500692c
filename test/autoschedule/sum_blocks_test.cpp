// Autoscheduling of tiled sums with a single consumer: computed block by block in the consumer's
// loops.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "graph/graph.h"
#include "ir/target.h"
#include "support/rules_schedule.h"

namespace retrograde {
namespace {

using Reading = std::function<Expr(const Func& sum, const Var& x, const Var& y, const Var& c)>;

// A convolution over all channels of an image, and its consumer.
struct Layer {
  explicit Layer(const Reading& read, int size = 200, int channels = 16)
      : size(size), image(size, size, channels), weights(3, 3, channels, channels) {
    fill(image, 0.5f);
    fill(weights, 0.02f);
    const Func padded = BoundaryConditions::constant_exterior(image, 0.0f);
    RDom r({{0, 3}, {0, 3}, {0, channels}}, "r");
    convolved(x, y, c) = 0.0f;
    convolved(x, y, c) += weights(r.x, r.y, r.z, c) * padded(x + r.x - 1, y + r.y - 1, r.z);
    result(x, y, c) = read(convolved, x, y, c);
    result.set_estimates({{0, size}, {0, size}, {0, channels}});
  }
  template <typename B>
  static void fill(B& buffer, float scale) {
    int at = 0;
    for (int i = 0; i < static_cast<int>(buffer.number_of_elements()); i++, at = (at * 7 + 5) % 31)
      buffer.data()[i] = scale * static_cast<float>(at - 15);
  }
  static const graph::LoopLevel& level(const Func& f) {
    return f.function()->schedule.compute_level;
  }
  bool is_in_blocks(const Func& f) const {
    return level(f).kind == graph::LoopLevel::Kind::At && level(f).func == result.name() &&
           level(f).var == "y";  // a slice is one channel
  }
  void schedule() { schedule_by_rules(Pipeline(result)); }
  Buffer<float> found(int rows) { return result.realize({size, rows, image.channels()}); }

  int size;
  Var x{"x"}, y{"y"}, c{"c"};
  Buffer<float> image, weights;
  Func convolved{"convolved"}, result{"result"};
};

void expect_same(const Buffer<float>& found, const Buffer<float>& expected, const std::string& of) {
  ASSERT_EQ(found.number_of_elements(), expected.number_of_elements());
  for (size_t i = 0; i < found.number_of_elements(); i++)
    ASSERT_NEAR(found.data()[i], expected.data()[i], 1e-4f) << of << ", element " << i;
}

// Sums at the same place are computed in tiles instead (epilogues_test.cpp).
Expr largest(const Func& sum, const Var& x, const Var& y, const Var& c) {
  return max(sum(x, y, c), sum(x + 1, y, c));
}

TEST(SumBlocks, AreInTheLoopsOfTheOnlyReader) {
  const std::vector<std::pair<std::string, Reading>> readings{
      {"larger of two", largest},
      {"neighbours in a row", [](const Func& sum, const Var& x, const Var& y,
                                 const Var& c) { return sum(x - 1, y, c) - sum(x + 1, y, c); }},
      {"every channel of a pixel", [](const Func& sum, const Var& x, const Var& y, const Var& c) {
         return sum(x, y, c) / (abs(sum(x, y, 0)) + abs(sum(x, y, 1)) + 1.0f);
       }}};
  for (const auto& [name, read] : readings) {
    Layer layer(read), plain(read);
    layer.schedule();
    EXPECT_TRUE(layer.is_in_blocks(layer.convolved)) << name;
    plain.convolved.compute_root();
    for (const int rows : {200, 77, 1}) expect_same(layer.found(rows), plain.found(rows), name);
  }
}

TEST(SumBlocks, ArePartOfTheSchedulesText) {
  Layer layer(largest);
  const std::string text = schedule_by_rules(Pipeline(layer.result)).to_cpp();
  EXPECT_NE(text.find("convolved.compute_at(LoopLevel(result, y))"), std::string::npos) << text;
}

TEST(SumBlocks, AreNotOfWhatStaysInACache) {
  Layer layer(largest, 60, 16);
  layer.schedule();
  EXPECT_FALSE(layer.is_in_blocks(layer.convolved));
}

TEST(SumBlocks, AreNotWhereOtherRowsAreRead) {
  Layer layer([](const Func& sum, const Var& x, const Var& y, const Var& c) {
    return sum(x, y, c) + sum(x, y + 1, c);
  });
  layer.schedule();
  EXPECT_FALSE(layer.is_in_blocks(layer.convolved));
}

TEST(SumBlocks, AreNotWhereTwoReadThem) {
  Layer layer(largest);
  Func other("other");
  other(layer.x, layer.y, layer.c) = exp(layer.convolved(layer.x, layer.y, layer.c));
  other.set_estimates({{0, 200}, {0, 200}, {0, 16}});
  schedule_by_rules(Pipeline({layer.result, other}));
  EXPECT_EQ(Layer::level(layer.convolved).kind, graph::LoopLevel::Kind::Root);
}

// The two may or may not use the same blocks; the values are checked.
TEST(SumBlocks, OfTwoSumsThatOneReads) {
  const auto both = [](Layer& layer, Func& second) {
    RDom k(0, 5, 0, 16, "k");
    second(layer.x, layer.y, layer.c) = 1.0f;
    second(layer.x, layer.y, layer.c) +=
        layer.weights(k.x % 3, 1, k.y, layer.c) *
        layer.image(clamp(layer.x + k.x, 0, layer.size - 1), layer.y, k.y);
    Func product("product");
    product(layer.x, layer.y, layer.c) =
        layer.convolved(layer.x - 1, layer.y, layer.c) * second(layer.x + 1, layer.y, layer.c);
    product.set_estimates({{0, layer.size}, {0, layer.size}, {0, 16}});
    return product;
  };
  Layer layer(largest), plain(largest);
  Func second("second"), plain_second("second");
  Func product = both(layer, second), plain_product = both(plain, plain_second);
  schedule_by_rules(Pipeline(product));
  EXPECT_EQ(Layer::level(layer.convolved).func, product.name());
  EXPECT_EQ(Layer::level(layer.convolved).var, "y");
  plain.convolved.compute_root();
  plain_second.compute_root();
  expect_same(product.realize({200, 200, 16}), plain_product.realize({200, 200, 16}), "product");
}

}  // namespace
}  // namespace retrograde
