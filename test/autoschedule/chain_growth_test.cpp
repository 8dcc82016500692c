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

#include "autodiff/derivative.h"
#include "autoschedule/default_schedule.h"
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

Stmt lower_gradient(const Func& loss, const Func& gradient, Laps& laps) {
  const std::vector<graph::FuncPtr> outputs =
      autoschedule::schedule_unscheduled({loss.function(), gradient.function()});
  laps.end("schedule_unscheduled");
  lower::LowerOptions options;
  options.observe = [&](const std::string& pass, double, const Stmt&) { laps.end(pass); };
  return lower::lower("chain", outputs, lower::infer_arguments(outputs), options).body;
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

// Checks that a program four times as long allocates about four times as much.
void expect_linear(const Work& some, const Work& many) {
  double all = 0;
  for (const auto& [part, bytes] : many) all += bytes;
  for (const auto& [part, bytes] : many) {
    if (bytes < all / 1000) continue;
    // Growth by n log n would give 1.18.
    EXPECT_LT(std::log(bytes / some.at(part)) / std::log(4), 1.2) << part;
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

// A separate loop body for the interior would save only a clamp beside hundreds of sines.
TEST(ChainGrowth, ABodyOfManyStatementsIsNotCopiedForItsBorders) {
  constexpr int statements = 800;
  Laps laps;
  int sines = 0;
  ir::walk(lower_statements(statements, laps),
           [&](const ir::Call& call) { sines += call.is_op(ir::Op::sin); });
  EXPECT_LE(sines, 2 * statements) << "those of the program and those of its gradient";
}

}  // namespace
}  // namespace retrograde
