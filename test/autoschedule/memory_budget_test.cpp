// Tests the memory of scheduled gradients: the scheduler's prediction, and the effect of a memory budget, both against
// the allocations of a run.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "graph/copy_graph.h"
#include "ir/target.h"

namespace retrograde {
namespace {

using gradient::random_image;

// Counts the bytes that compiled code has allocated and not freed, now and at the peak.
struct Allocations {
  static constexpr size_t header = 128;  // also the alignment
  static inline std::atomic<int64_t> now{0}, most{0};
  static void* take(void*, size_t bytes) {
    const size_t rounded = (bytes + 2 * header - 1) / header * header;
    auto* block = static_cast<char*>(std::aligned_alloc(header, rounded));
    *reinterpret_cast<int64_t*>(block) = static_cast<int64_t>(bytes);
    const int64_t after = now += static_cast<int64_t>(bytes);
    for (int64_t seen = most; seen < after && !most.compare_exchange_weak(seen, after);) {
    }
    return block + header;
  }
  static void give_back(void*, void* block) {
    if (!block) return;
    char* begin = static_cast<char*>(block) - header;
    now -= *reinterpret_cast<int64_t*>(begin);
    std::free(begin);
  }
};

struct Program {
  std::vector<Func> outputs;
  std::vector<std::vector<int>> sizes;
  std::vector<Buffer<float>> inputs;

  int64_t callers_bytes() const {
    int64_t bytes = 0;
    for (const Buffer<float>& input : inputs) bytes += static_cast<int64_t>(input.size_in_bytes());
    for (const std::vector<int>& size : sizes) {
      int64_t elements = 1;
      for (int n : size) elements *= n;
      bytes += elements * 4;
    }
    return bytes;
  }
  Pipeline copy() const {
    std::vector<graph::FuncPtr> functions;
    for (const Func& f : outputs) functions.push_back(f.function());
    std::vector<Func> copies;
    for (const graph::FuncPtr& f : graph::copy_graph(functions).outputs) copies.emplace_back(f);
    for (size_t i = 0; i < copies.size(); ++i) {
      for (size_t d = 0; d < sizes[i].size(); ++d)
        copies[i].set_estimate(copies[i].args()[d], 0, sizes[i][d]);
    }
    return Pipeline(copies);
  }
  std::vector<Buffer<>> buffers() const {
    std::vector<Buffer<>> result;
    for (const std::vector<int>& size : sizes) result.push_back(Buffer<float>(size));
    return result;
  }
};

// Several planes of weights, each read by several sums.
Program weighted(int planes) {
  const Buffer<float> image = random_image({160, 120}, 0, 1, 1);
  Var x("x"), y("y"), p("p");
  Func f = BoundaryConditions::repeat_edge(image);
  RDom near(-1, 3, -1, 3), all(0, planes);
  Func distance("distance"), weight("weight"), weights("weights"), values("values"), out("out");
  distance(x, y, p) = 0.0f;
  distance(x, y, p) += pow(f(x + near.x, y + near.y) - f(x + near.x + p, y + near.y), 2);
  weight(x, y, p) = exp(-distance(x, y, p));
  weights(x, y) = 0.0f;
  weights(x, y) += weight(x, y, all);
  values(x, y) = 0.0f;
  values(x, y) += weight(x, y, all) * f(x + all, y);
  out(x, y) = values(x, y) / weights(x, y);
  const Derivative d = propagate_adjoints(out, random_image({160, 120}, -1, 1, 2));
  return {{out, d(image)}, {{160, 120}, {160, 120}}, {image}};
}

// Steps that each read the previous one, and a gradient that reads all of them.
Program steps(int count) {
  const Buffer<float> image = random_image({200, 150}, 0, 1, 1);
  Var x("x"), y("y");
  Func state("state");
  state(x, y) = image(x, y);
  for (int i = 0; i < count; ++i) {
    Func f = BoundaryConditions::repeat_edge(state, {{0, 200}, {0, 150}}), next("state");
    next(x, y) = sin(f(x - 1, y) + f(x + 1, y)) * f(x, y) + cos(f(x, y + 1));
    state = next;
  }
  const Derivative d = propagate_adjoints(state, random_image({200, 150}, -1, 1, 2));
  return {{state, d(image)}, {{200, 150}, {200, 150}}, {image}};
}

// Steps of a linear iteration, each of which reads the right-hand side.
Program relaxed(int count) {
  const Buffer<float> rhs = random_image({200, 150}, 0, 1, 1);
  Var x("x"), y("y");
  Func state("state"), start = BoundaryConditions::repeat_edge(rhs);
  state(x, y) = rhs(x, y);
  for (int i = 0; i < count; ++i) {
    Func f = BoundaryConditions::repeat_edge(state, {{0, 200}, {0, 150}}), next("state");
    next(x, y) = 0.2f * (f(x - 1, y) + f(x + 1, y) + f(x, y - 1) + f(x, y + 1)) + start(x, y);
    state = next;
  }
  const Derivative d = propagate_adjoints(state, random_image({200, 150}, -1, 1, 2));
  return {{state, d(rhs)}, {{200, 150}, {200, 150}}, {rhs}};
}

// Samples images at positions that a few numbers of each frame determine, and differentiates the squares of the samples
// by these numbers: eight sums over one chain of values.
Program placed(int frames) {
  const Buffer<float> numbers = random_image({8, frames}, 0, 0.1, 1),
                      seen = random_image({200, 150, frames}, 0, 1, 2);
  Var x("x"), y("y"), i("i");
  Func depth("depth"), shift_x("shift_x"), shift_y("shift_y"), residual("residual"), loss("loss");
  const Expr u = (cast<float>(x) - 100) / 100, v = (cast<float>(y) - 75) / 100;
  const auto n = [&](int k) { return Expr(numbers(k, i)); };
  depth(x, y, i) = 1 + n(6) * u + n(7) * v;
  shift_x(x, y, i) = (n(0) * u + n(1) * v + n(2)) / max(depth(x, y, i), 0.1f);
  shift_y(x, y, i) = (n(3) * u + n(4) * v + n(5)) / max(depth(x, y, i), 0.1f);
  residual(x, y, i) = sin(shift_x(x, y, i)) * cos(shift_y(x, y, i)) - seen(x, y, i);
  RDom all(0, 200, 0, 150, 0, frames);
  loss() = 0.0f;
  loss() += residual(all.x, all.y, all.z) * residual(all.x, all.y, all.z);
  const Derivative d = propagate_adjoints(loss);
  return {{loss, d(numbers)}, {{}, {8, frames}}, {numbers, seen}};
}

double product(const Buffer<float>& a, const Buffer<float>& b) {
  double sum = 0;
  a.for_each_element([&](const int* at) { sum += double(a(at)) * b(at); });
  return sum;
}

struct Outcome {
  AutoSchedulerResults said;
  int64_t allocated = 0;  // at the most
  std::vector<Buffer<>> results;
};

Outcome run(const Program& program, const AutoscheduleOptions& options) {
  Outcome result;
  Pipeline pipeline = program.copy();
  result.said =
      pipeline.auto_schedule(get_jit_target_from_environment(), options,
                             MachineParams(2, 64 << 10, 40));  // few bytes stay in its caches
  pipeline.set_custom_allocator(Allocations::take, Allocations::give_back);
  result.results = program.buffers();
  Allocations::most = Allocations::now.load();
  const int64_t before = Allocations::now;
  pipeline.realize(result.results);
  EXPECT_EQ(Allocations::now, before);
  result.allocated = Allocations::most - before;
  return result;
}

void expect_same(const Outcome& a, const Outcome& b) {
  for (size_t i = 0; i < a.results.size(); ++i) {
    Buffer<float> first = a.results[i], second = b.results[i];
    first.for_each_element([&](const int* at) {
      EXPECT_NEAR(first(at), second(at), 1e-4 * (1 + std::abs(second(at))));
    });
  }
}

// Only the live buffers matter, not the programs' names.
TEST(MemoryBudget, WhatIsSaidIsWhatIsAllocated) {
  for (const Program& program : {weighted(4), weighted(12), steps(3), steps(9), relaxed(24)}) {
    const Outcome found = run(program, {});
    const int64_t said = found.said.memory_bytes - program.callers_bytes();
    EXPECT_GT(said, 0);
    EXPECT_LT(found.allocated, 1.2 * static_cast<double>(said) + 65536);
    EXPECT_GT(found.allocated, 0.7 * static_cast<double>(said) - 65536);
  }
}

TEST(MemoryBudget, IsKeptByComputingAgain) {
  const Program program = weighted(12);
  AutoscheduleOptions options;
  options.memory_budget = int64_t(1) << 40;
  const Outcome large = run(program, options);
  options.memory_budget = large.said.memory_bytes - large.allocated / 4;
  const Outcome small = run(program, options);
  EXPECT_LE(small.said.memory_bytes, options.memory_budget);
  EXPECT_EQ(small.said.memory_budget_bytes, options.memory_budget);
  EXPECT_LE(small.allocated, large.allocated * 3 / 4 + 65536);
  expect_same(small, large);
}

TEST(MemoryBudget, WhatCannotBeKeptIsSaidAndRuns) {
  const Program program = steps(6);
  AutoscheduleOptions options;
  options.memory_budget = int64_t(1) << 40;
  const Outcome large = run(program, options);
  options.memory_budget = 1;
  const Outcome small = run(program, options);
  EXPECT_GT(small.said.memory_bytes, small.said.memory_budget_bytes);
  EXPECT_LE(small.said.memory_bytes, large.said.memory_bytes);
  expect_same(small, large);
}

// The default budget is inputs, outputs and twice the largest Func of the program, or the size of the caches if that is
// larger.
TEST(MemoryBudget, IsTwiceTheLargestFuncByDefault) {
  const Program program = weighted(12);
  const Outcome found = run(program, {});
  const int64_t seed = 160 * 120 * 4, planes = 160 * 120 * 12 * 4;
  EXPECT_EQ(found.said.memory_budget_bytes, program.callers_bytes() + seed + 2 * planes);
}

double predicted_ms(const Program& program, const AutoscheduleOptions& options) {
  Pipeline pipeline = program.copy();
  const Target target = get_jit_target_from_environment();
  pipeline.auto_schedule(target, options, MachineParams(2, 64 << 10, 40));
  return pipeline.explain_schedule(Realization(program.buffers()), target).predicted_ms;
}

// Each Func of a chain is cheap to recompute, but all of them are not: recomputing the last one recomputes all before
// it, for each of its consumers.
TEST(MemoryBudget, CountsWhatAChainComputesAgain) {
  const Program program = placed(13);
  AutoscheduleOptions large;
  large.memory_budget = int64_t(1) << 40;
  EXPECT_LT(predicted_ms(program, {}), 1.5 * predicted_ms(program, large));
}

// The adjoints of the steps are accumulated as they are computed, so the peak memory does not grow with the number of
// steps: two programs of different length may have different loops, and a few images more. Expected values: a linear
// program's output is its derivative at the input, <A b, s> = <b, A^T s>.
TEST(MemoryBudget, AdjointsOfStepsAreAddedUpWhenTheyAreMade) {
  const Outcome few = run(relaxed(12), {}), many = run(relaxed(36), {});
  const int64_t image = 200 * 150 * 4;
  EXPECT_LT(many.allocated, few.allocated + 4.1 * image);
  EXPECT_LT(many.allocated, 12 * image);
  const Buffer<float> rhs = random_image({200, 150}, 0, 1, 1),
                      seed = random_image({200, 150}, -1, 1, 2);
  for (const Outcome& found : {few, many}) {
    const double forward = product(found.results[0], seed), back = product(found.results[1], rhs);
    EXPECT_NEAR(forward, back, 1e-4 * std::abs(forward) + 1e-2);
  }
}

TEST(MemoryBudget, SaysNothingOfUnknownSizes) {
  ImageParam image(Float(32), 2);
  Var x("x"), y("y");
  Func a("a"), b("b");
  a(x, y) = exp(image(x, y));
  b(x, y) = a(x, y) + a(x + 1, y) + a(x, y + 1);
  AutoscheduleOptions options;
  options.memory_budget = 1;
  Pipeline(b).auto_schedule(get_host_target(), options);
  EXPECT_NE(a.function()->schedule.compute_level.kind, graph::LoopLevel::Kind::Inlined);
}

}  // namespace
}  // namespace retrograde
