// The order of loop nests at root: producers first, and few images alive at once.
#include "graph/computing_order.h"

#include <gtest/gtest.h>

namespace retrograde {
namespace {

using graph::ComputedFunc;
using graph::computing_order;

ComputedFunc image(std::vector<size_t> callees) { return {std::move(callees), {}, 2, false}; }
ComputedFunc output(std::vector<size_t> callees) { return {std::move(callees), {}, 2, true}; }

TEST(ComputingOrder, OutputsAreComputedEarly) {
  EXPECT_EQ(computing_order({image({}), image({}), output({0}), output({1})}),
            (std::vector<size_t>{0, 2, 1, 3}));
}

TEST(ComputingOrder, WhoReadsManyIsComputedEarly) {
  const std::vector<ComputedFunc> funcs = {image({}),     image({0}), image({1}),
                                           image({2}),    image({3}), image({0, 1, 2, 3}),
                                           output({4, 5})};
  EXPECT_EQ(computing_order(funcs), (std::vector<size_t>{0, 1, 2, 3, 5, 4, 6}));
}

TEST(ComputingOrder, LoopsOfAHostStayBeforeIt) {
  std::vector<ComputedFunc> funcs = {image({}), image({}), image({0}), output({2}), output({1})};
  funcs[2].host = 3;
  EXPECT_EQ(computing_order(funcs), (std::vector<size_t>{0, 2, 3, 1, 4}));
}

// Adjoints of linear steps need no values. Computed first, they would all stay alive until the
// steps' values are there.
TEST(ComputingOrder, AnotherOutputComesFirstWhereThatKeepsFewer) {
  std::vector<ComputedFunc> funcs;
  const size_t steps = 12;
  for (size_t i = 0; i < steps; ++i)
    funcs.push_back(image(i ? std::vector{i - 1} : std::vector<size_t>()));
  funcs.push_back(output({steps - 1}));  // needs only the adjoints
  for (size_t i = 0; i < steps; ++i)
    funcs.push_back(image(i ? std::vector{steps + i} : std::vector<size_t>()));
  // Sums of an adjoint and a value, beginning with the last step.
  size_t sum = 0;
  for (size_t i = 0; i < steps; ++i) {
    std::vector<size_t> reads = {i, 2 * steps - i};
    if (i > 0) reads.push_back(sum);
    sum = funcs.size();
    funcs.push_back(i + 1 < steps ? image(reads) : output(reads));
  }
  const std::vector<size_t> order = computing_order(funcs);
  std::vector<size_t> place(order.size());
  for (size_t p = 0; p < order.size(); ++p) place[order[p]] = p;
  for (size_t f = 0; f < funcs.size(); ++f) {
    for (const size_t callee : funcs[f].callees) EXPECT_LT(place[callee], place[f]);
  }
  EXPECT_LT(place[2 * steps], place[1]);  // the last value comes before the second adjoint
}

}  // namespace
}  // namespace retrograde
