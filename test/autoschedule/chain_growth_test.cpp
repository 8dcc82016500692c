// Tests that the compiler's work grows linearly with the number of stages. The program is a chain of stencils with its
// gradient, compiled up to the statement that LLVM receives. Work is measured in allocated bytes instead of time,
// because any code that copies or builds something must allocate.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <map>
#include <new>
#include <string>
#include <vector>

#include "autodiff/derivative.h"
#include "driver/schedule.h"
#include "frontend/run/pipeline.h"
#include "ir/visit.h"
#include "lower/lower.h"

namespace {
std::atomic<uint64_t> allocated_bytes{0};
}

void* operator new(std::size_t bytes) {
  allocated_bytes += bytes;
  if (void* memory = std::malloc(bytes ? bytes : 1)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace retrograde {
namespace {

// Allocated bytes by part of the compiler.
using Work = std::map<std::string, double>;

class Laps {
 public:
  void end(const std::string& part) {
    const uint64_t now = allocated_bytes;
    work[part] = static_cast<double>(now - before_);
    before_ = now;
  }
  Work work;

 private:
  uint64_t before_ = allocated_bytes;
};

Stmt lower_gradients(const std::vector<Func>& funcs, Laps& laps) {
  std::vector<graph::FuncPtr> outputs;
  for (const Func& f : funcs) outputs.push_back(f.function());
  outputs = driver::schedule_unscheduled(outputs);
  laps.end("schedule_unscheduled");
  lower::LowerOptions options;
  options.observe = [&](const std::string& pass, double, const Stmt&) { laps.end(pass); };
  return lower::lower("chain", outputs, lower::infer_arguments(outputs), options).body;
}

Stmt lower_gradient(const Func& loss, const Func& gradient, Laps& laps) {
  return lower_gradients({loss, gradient}, laps);
}

Work work_of_chain(int stages) {
  Laps laps;
  constexpr int side = 1024;  // stages in strips, however many
  Buffer<float> image(side, side);
  Var x("x"), y("y");
  Func last("stage");
  last(x, y) = image(clamp(x, 0, side - 1), clamp(y, 0, side - 1)) * 2.0f;
  for (int i = 1; i < stages; i++) {
    Func next("stage");
    next(x, y) = (last(x - 1, y) + last(x, y) * 2.0f + last(x + 1, y) + last(x, y + 1)) * 0.2f;
    last = next;
  }
  Func loss("loss");
  RDom r(0, side, 0, side);
  loss() = 0.0f;
  loss() += last(r.x, r.y) * last(r.x, r.y);
  laps.end("program");
  const Func gradient = propagate_adjoints(loss)(image);
  laps.end("propagate_adjoints");
  Pipeline({loss, gradient}).auto_schedule(get_jit_target_from_environment());
  laps.end("auto_schedule");
  lower_gradient(loss, gradient, laps);
  return laps.work;
}

// One expression of many statements, as the unrolled loop of a host program builds it.
Stmt lower_statements(int statements, Laps& laps) {
  Buffer<float> image(64, 64), factor(64, 64);
  Var x("x"), y("y");
  Expr a = image(x, y), b = factor(x, y);
  for (int i = 0; i < statements; i++) a = a + 0.001f * sin(b * a);
  Func out("out"), loss("loss");
  out(x, y) = a;
  RDom r(0, 64, 0, 64);
  loss() = 0.0f;
  loss() += out(r.x, r.y) * out(r.x, r.y);
  laps.end("program");
  const Func gradient = propagate_adjoints(loss)(image);
  laps.end("propagate_adjoints");
  return lower_gradient(loss, gradient, laps);
}

Work work_of_statements(int statements) {
  Laps laps;
  lower_statements(statements, laps);
  return laps.work;
}

// A long program of each element whose gradient is by several images of parameters, read at constant indices.
Work work_of_parameters(int steps) {
  Laps laps;
  constexpr int elements = 8192;
  std::vector<Buffer<float>> parameters;
  for (int k = 0; k < 4; ++k) parameters.emplace_back(steps);
  Buffer<float> start(elements);
  Var i("i");
  Expr a = start(i);
  for (int step = 0; step < steps; ++step) {
    for (const Buffer<float>& p : parameters) a = sqrt(a * a + p(step)) / (a + 2.0f);
  }
  Func out("out"), loss("loss");
  out(i) = a;
  RDom r(0, elements);
  loss() = 0.0f;
  loss() += out(r) * out(r);
  laps.end("program");
  const Derivative d = propagate_adjoints(loss);
  std::vector<Func> gradients{loss};
  for (const Buffer<float>& p : parameters) gradients.push_back(d(p));
  laps.end("propagate_adjoints");
  Pipeline(gradients).auto_schedule(get_jit_target_from_environment());
  laps.end("auto_schedule");
  lower_gradients(gradients, laps);
  return laps.work;
}

// Checks that a program four times as long allocates about four times as much.
void expect_linear(const Work& some, const Work& many) {
  double all = 0;
  for (const auto& [part, bytes] : many) all += bytes;
  for (const auto& [part, bytes] : many) {
    if (bytes < all / 1000) continue;
    // Growth by n log n would give 1.18. Each plan that a search prices has a pointer for each Func.
    const double most = part == "auto_schedule" ? 2.8 : part == "keep_accumulators" ? 1.5 : 1.2;
    EXPECT_LT(std::log(bytes / some.at(part)) / std::log(4), most) << part;
  }
}

TEST(ChainGrowth, EachStageCostsEveryPartOfTheCompilerAsMuch) {
  work_of_chain(8);  // warms up what is initialised once
  const Work some = work_of_chain(120);
  expect_linear(some, work_of_chain(480));
}

TEST(ChainGrowth, EachUnrolledStatementCostsEveryPartOfTheCompilerAsMuch) {
  work_of_statements(8);
  const Work some = work_of_statements(200);
  expect_linear(some, work_of_statements(800));
}

TEST(ChainGrowth, EachParameterCostsEveryPartOfTheCompilerAsMuch) {
  work_of_parameters(2);
  const Work some = work_of_parameters(6);
  expect_linear(some, work_of_parameters(24));
}

// A long body in parallel pieces of a row: the last piece is shorter, and needs no code of its own.
TEST(ChainGrowth, ABodyOfManyStatementsIsNotCopiedForTheLastPiece) {
  constexpr int statements = 200, elements = 100000;
  Laps laps;
  Buffer<float> start(elements), factor(elements);
  Var i("i");
  Expr a = start(i);
  for (int k = 0; k < statements; ++k) a = a + 0.001f * sin(factor(i) * a);
  Func out("out"), loss("loss");
  out(i) = a;
  RDom r(0, elements);
  loss() = 0.0f;
  loss() += out(r) * out(r);
  Func gradient = propagate_adjoints(loss)(start);
  gradient.output_buffer().dim(0).set_bounds(0, elements);
  Pipeline({loss, gradient}).auto_schedule(get_jit_target_from_environment());
  int sines = 0;
  ir::walk(lower_gradient(loss, gradient, laps),
           [&](const ir::Call& call) { sines += call.is_op(ir::Op::sin); });
  EXPECT_LE(sines, 3 * statements) << "of the program, with a short last piece, and its gradient";
}

// Steps that read parameters by their number.
TEST(ChainGrowth, StepsThatReadByTheirNumberAreLoweredOnce) {
  const auto roots_of = [](int steps) {
    Buffer<float> start(64, 64);
    ImageParam weights(Float(32), 1, "weights");  // elements of a Buffer would be constants
    weights.dim(0).set_bounds(0, steps + 1);
    Var x("x"), y("y");
    Func last("step");
    last(x, y) = start(x, y);
    for (int k = 0; k < steps; ++k) {
      const Expr here = last(x, y), before = last(max(x - 1, 0), y);
      Func next("step");
      next(x, y) = sqrt(here * here + weights(k) * before * before + weights(k + 1)) *
                       (sqrt(before + 2.0f) + 0.5f) +
                   here * 0.25f;
      next.compute_root().vectorize(x, 8).bound(x, 0, 64).bound(y, 0, 64);
      last = next;
    }
    int roots = 0;
    lower::LowerOptions options;
    options.observe = [&](const std::string& pass, double, const Stmt& s) {
      if (pass != "share_equal_nests") return;
      ir::walk(s, [&](const ir::Call& call) { roots += call.is_op(ir::Op::sqrt); });
    };
    const std::vector<graph::FuncPtr> outputs{last.function()};
    lower::lower("steps", outputs, lower::infer_arguments(outputs), options);
    return roots;
  };
  EXPECT_EQ(roots_of(12), roots_of(6)) << "the first and the last differ from the others";
}

// A separate loop body for the interior would save only a clamp beside hundreds of sines.
TEST(ChainGrowth, ABodyOfManyStatementsIsNotCopiedForItsBorders) {
  constexpr int statements = 800;
  Laps laps;
  int sines = 0;
  ir::walk(lower_statements(statements, laps),
           [&](const ir::Call& call) { sines += call.is_op(ir::Op::sin); });
  EXPECT_LE(sines, 3 * statements) << "of the program, with a short last piece, and its gradient";
}

}  // namespace
}  // namespace retrograde
