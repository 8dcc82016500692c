// Tests checkpointing: loops over time that run backward from a few kept states. Oracles: central differences; the
// gradient that keeps all versions, bit by bit; the memory that the profiler reports; the steps that the interpreter
// evaluates.
#include <atomic>

#include "autodiff/time/revolve.h"
#include "gradient/programs_suite.h"
#include "support/errors.h"
#include "support/facts.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y");

// A state u(x), pushed by a force for n steps, nonlinear in u.
Program pushed(int n) {
  Buffer<float> start = line(7), stiffness = line(1, 4), force = plane(7, n);
  Func u("pushed_u");
  RDom t(0, n);
  u(x) = start(x);
  u(x) = u(x) + 0.125f * (force(x, t) - stiffness(Expr(0)) * sin(u(x)));
  return {weighted_sum(u, {7}), {start, stiffness, force}};
}

// A row that every step sweeps from left to right in place: iterations of one step depend on each other.
Program swept(int n) {
  Buffer<float> start = line(8), weights = line(3, 4);
  Func u("swept_u");
  RDom r(1, 6, 0, n);
  u(x) = start(x);
  u(r.x) = weights(Expr(0)) * 0.25f * u(r.x - 1) + weights(Expr(1)) * 0.25f * sin(u(r.x)) +
           weights(Expr(2)) * u(r.x + 1) * 0.125f;
  return {weighted_sum(u, {8}), {start, weights}};
}

// Positions and velocities of pendulums.
Program pendulums(int n) {
  Buffer<float> angle = line(5), gravity = line(5, 9);
  Func u("pendulum"), end("end");
  RDom t(0, n);
  u(x) = Tuple(angle(x), 0.0f);
  Expr wind = 0.0625f * cos(cast<float>(t));
  Expr speed = u(x)[1] + wind - 0.125f * gravity(x) * sin(u(x)[0]);
  u(x) = Tuple(u(x)[0] + 0.125f * speed, speed);
  end(x) = u(x)[0] * u(x)[1];
  return {weighted_sum(end, {5}), {angle, gravity}};
}

// Two rows that alternate as source and destination.
Program diffusion(int n) {
  Buffer<float> start = line(9), k = line(9, 3);
  Func u("two_rows");
  RDom r(1, 7, 0, n);
  u(x, y) = start(x) + 0.0f * cast<float>(y);
  Expr old = r.y % 2, here = u(r.x, old);
  u(r.x, (r.y + 1) % 2) =
      here + 0.25f * k(r.x) * (u(r.x - 1, old) - 2.0f * here + u(r.x + 1, old)) * here;
  return {weighted_sum(u, {9, 2}), {start, k}};
}

// Only some steps push some elements; time does not start at 0.
Program predicated(int n) {
  Buffer<float> start = line(6), gain = line(6, 5);
  Func u("predicated_u");
  RDom r(0, 6, 3, n);
  r.where(r.x + r.y < 9 && r.x % 2 == r.y % 2);
  u(x) = start(x);
  u(r.x) = u(r.x) * gain(r.x) * u(5 - r.x) + 0.125f;
  return {weighted_sum(u, {6}), {start, gain}};
}

// A step needs no values of the state for its derivative, so nothing is kept.
Program linear(int n) {
  Buffer<float> start = line(6), decay = plane(6, n, 8);
  Func u("linear_u");
  RDom t(0, n);
  u(x) = start(x);
  u(x) = u(x) * 0.75f + decay(x, t);
  return {weighted_sum(u, {6}), {start, decay}};
}

// Two pure dimensions: parallel rows in vectors.
Program field(int n) {
  Buffer<float> start = plane(19, 3), gain = line(3, 7);
  Func u("field_u");
  RDom t(0, n);
  u(x, y) = start(x, y);
  u(x, y) = u(x, y) + 0.125f * gain(y) * sin(u(x, y) + cast<float>(t));
  return {weighted_sum(u, {19, 3}), {start, gain}};
}

// An integer beside the value decides what a step does.
Program steered(int n) {
  Buffer<float> start = line(6), gain = line(6, 7);
  Func u("steered_u"), end("end");
  RDom t(0, n);
  u(x) = Tuple(start(x), x);
  Expr value = u(x)[0], state = u(x)[1];
  u(x) = Tuple(select(state % 3 == 0, value * gain(x), sin(value) + 0.25f), state * 5 + 1 + t);
  end(x) = u(x)[0];
  return {weighted_sum(end, {6}), {start, gain}};
}

// States in double, inputs in float32.
Program wide(int n) {
  Buffer<float> start = line(4), gain = line(4, 7);
  Func u("wide_u"), end("end");
  RDom t(0, n);
  u(x) = cast<double>(start(x));
  u(x) = u(x) + sin(u(x)) * gain(x) * cast<double>(t) * 0.03125;
  end(x) = cast<float>(u(x));
  return {weighted_sum(end, {4}), {start, gain}};
}

// Two loops over the same state.
Program twice(int n) {
  Buffer<float> start = line(5), gain = line(5, 7);
  Func u("twice_u");
  RDom t(0, n), s(0, n + 1);
  u(x) = start(x);
  u(x) = u(x) * gain(x) + 0.25f * sin(u(x) + cast<float>(t));
  u(x) = u(x) + 0.5f * gain(x);
  u(x) = cos(u(x)) * 0.5f + 0.0625f * cast<float>(s) * u(x);
  return {weighted_sum(u, {5}), {start, gain}};
}

// A single number, without dimensions.
Program number(int n) {
  Buffer<float> start = line(1), factors = line(n, 7), gain = line(1, 2);
  Func u("number_u"), loss("loss");
  RDom t(0, n);
  u() = start(Expr(0));
  u() = sin(u() * factors(t)) + gain(Expr(0)) * 0.5f * u();
  loss() = u() * u() * 0.5f;
  return {loss, {start, factors, gain}};
}

const NamedLoop cases[] = {
    {"pushed", pushed},       {"swept", swept},           {"pendulums", pendulums},
    {"diffusion", diffusion}, {"predicated", predicated}, {"linear", linear},
    {"field", field},         {"steered", steered},       {"wide", wide},
    {"twice", twice},         {"number", number}};

TEST(Checkpoints, GradientsAgreeWithCentralDifferences) {
  for (const NamedLoop& c : cases) {
    SCOPED_TRACE(c.name);
    Program p = c.build(6);
    for (Buffer<float>& input : p.inputs) expect_gradient(p.loss, input, {.checkpoint_states = 2});
  }
}

std::vector<double> values_of(const Func& gradient, const Buffer<float>& like, bool exact) {
  oracle::InterpreterOptions options;
  options.widen = !exact;
  oracle::Region region = oracle::region_of(*like.raw_buffer());
  std::vector<double> result;
  oracle::Array array = oracle::Interpreter(options).realize(gradient.function(), region).front();
  for (const oracle::Value& v : array.values) result.push_back(v.scalar.as_double());
  return result;
}

// Bits agree in float32, operation by operation. Contributions of steps to inputs without a time axis are an exception:
// they are summed from the last step to the first, and without a budget in another order, so they agree only up to
// rounding.
TEST(Checkpoints, GradientsAreTheBitsOfTheStoredOnes) {
  for (const NamedLoop& c : cases) {
    for (int n : {3, 7}) {
      Program p = c.build(n);
      Derivative stored = propagate_adjoints(p.loss, {.overwritten = Overwritten::Store});
      for (int s : {1, 2, 3, 20}) {
        SCOPED_TRACE(text(c.name, ", ", n, " steps, ", s, " states"));
        Derivative d = propagate_adjoints(p.loss, {.checkpoint_states = s});
        for (size_t i = 0; i < p.inputs.size(); ++i) {
          std::vector<double> expected = values_of(stored(p.inputs[i]), p.inputs[i], true);
          std::vector<double> found = values_of(d(p.inputs[i]), p.inputs[i], true);
          for (size_t at = 0; at < expected.size(); ++at) {
            if (i == 0) {
              EXPECT_EQ(found[at], expected[at]);
            } else {
              EXPECT_NEAR(found[at], expected[at], 2e-6 * (1 + std::abs(expected[at])));
            }
          }
        }
      }
    }
  }
}

TEST(Checkpoints, MachineCodeGivesTheSameBitsForEveryBudget) {
  for (const NamedLoop& c : cases) {
    Program p = c.build(8);
    std::vector<Buffer<float>> expected;
    for (int s : {1, 3}) {
      SCOPED_TRACE(text(c.name, ", ", s, " states"));
      Derivative d = propagate_adjoints(p.loss, {.checkpoint_states = s});
      for (size_t i = 0; i < p.inputs.size(); ++i) {
        oracle::Region region = oracle::region_of(*p.inputs[i].raw_buffer());
        Buffer<float> found = d(p.inputs[i]).realize(region.extents);
        if (s == 1) {
          expected.push_back(found);
        } else {
          region.for_each([&](const std::vector<int>& at) {
            EXPECT_EQ(found.get()->operator()(at.data()), expected[i].get()->operator()(at.data()));
          });
        }
      }
    }
  }
}

// ---- what it costs ----

std::atomic<int64_t> evaluations;
extern "C" __attribute__((visibility("default"))) float checkpoint_test_counted(float value) {
  ++evaluations;
  return value;
}

// A C function counts the evaluations of a step.
Func counted(const Buffer<float>& start, const Expr& n) {
  Func u("counted_u");
  RDom t(0, n);
  u(x) = start(x);
  Expr force = ir::call_extern("checkpoint_test_counted", Float(32), {cast<float>(t)});
  u(x) = u(x) + 0.125f * sin(u(x)) + stop_gradient(force) * 0.0625f;
  return weighted_sum(u, {start.width()});
}

TEST(Checkpoints, StepsAreComputedAgainAsOftenAsTheBinomialBoundSays) {
  Buffer<float> start = line(1);  // values that do not depend on x are computed once for a vector
  for (auto [n, s, again] : {std::tuple(10, 1, 45),
                             {10, 3, 15},
                             {10, 10, 9},
                             {35, 4, 3 * 35 - 21},
                             {56, 3, 5 * 56 - 70}}) {
    Derivative d = propagate_adjoints(counted(start, n), {.wrt = {start}, .checkpoint_states = s});
    Func gradient = d(start);
    gradient.compile_jit();
    evaluations = 0;
    gradient.realize({1});
    // The loss needs the last state: n steps before anything runs backward.
    EXPECT_EQ(evaluations, n + again + n) << n << " steps, " << s << " states";
  }
}

// The peak of allocated bytes, as the profiler reports it.
TEST(Checkpoints, MemoryGrowsWithTheStatesAndNotWithTheSteps) {
  Buffer<float> start = line(100);
  auto peak = [&](int n, const AdjointOptions& options) {
    Func u("remembered_u");
    RDom t(0, n);
    u(x) = start(x);
    u(x) = u(x) + 0.125f * sin(u(x) + cast<float>(t));
    AdjointOptions only = options;
    only.wrt = {start};
    return peak_memory(propagate_adjoints(weighted_sum(u, {100}), only), start);
  };
  int64_t state = 400;
  const AdjointOptions stored{.overwritten = Overwritten::Store};
  EXPECT_GT(peak(500, stored),
            4 * peak(100, stored));  // a schedule may keep those of a part of the line
  int64_t ten = peak(500, {.checkpoint_states = 10});
  EXPECT_LT(ten, 20 * state);
  EXPECT_EQ(peak(1000, {.checkpoint_states = 10}), ten);
  EXPECT_EQ(peak(500, {.checkpoint_states = 20}), ten + 10 * state);
  EXPECT_EQ(peak(500, {.checkpoint_bytes = 10 * 400 + 399}), ten);
}

// A parameter and an image without a time axis take no memory for each step, however many steps contribute to them.
TEST(Checkpoints, GradientsOfWhatEveryStepReadsTakeNoMemoryForEachStep) {
  Buffer<float> start = line(50), k = line(50, 3);
  auto peak = [&](int n) {
    Func u("shared_u");
    RDom t(0, n);
    u(x) = start(x);
    u(x) = u(x) + 0.125f * k(x) * sin(u(x) + cast<float>(t));
    return peak_memory(
        propagate_adjoints(weighted_sum(u, {50}), {.wrt = {k}, .checkpoint_states = 6}), k);
  };
  EXPECT_NEAR(double(peak(400)), double(peak(100)), 512);
}

// Float32 sums of 10,000 equal terms lose four digits when added one by one.
TEST(Checkpoints, SumsOverLongTimesKeepTheirDigits) {
  Buffer<float> start = line(2), push = line(1, 3);
  Func u("long_pushed_u"), loss("loss");
  RDom t(0, 10000), r(0, 2);
  u(x) = start(x);
  u(x) = u(x) * 1.0f + push(Expr(0)) * 0.1f + 0.0f * cast<float>(t);
  loss() = 0.0f;
  loss() += u(r);
  Derivative d = propagate_adjoints(loss, {.wrt = {push}, .checkpoint_states = 5});
  float found = Buffer<float>(d(push).realize({1}))(0);
  EXPECT_NEAR(found, 2 * 10000 * double(0.1f), 2 * 10000 * 0.1 * 2e-7);
}

TEST(Checkpoints, OperationsFollowTheSchedule) {
  for (int s : {1, 4, 10, 100}) {
    Program p = pushed(100);
    Derivative d = propagate_adjoints(p.loss, {.wrt = {p.inputs[0]}, .checkpoint_states = s});
    double again = static_cast<double>(autodiff::revolve_advances(100, s));
    // Each step that is run takes 7 sines: for the loss, for the recomputation, and for its reversal, which also takes
    // a cosine.
    EXPECT_EQ(d.operations().gradient.nonlinear().value(), 7 * (100 + again + 100 + 100));
  }
}

// ---- what it is part of ----

TEST(Checkpoints, TheGradientCanBeDifferentiatedAgain) {
  Program p = pushed(4);
  Derivative d = propagate_adjoints(p.loss, {.checkpoint_states = 2});
  Func gradient = d(p.inputs[0]);
  Func second = weighted_sum(gradient, {7});
  expect_gradient(second, p.inputs[0], {.overwritten = Overwritten::Store});
  expect_gradient(second, p.inputs[1], {.overwritten = Overwritten::Store});
}

TEST(Checkpoints, ExplainSaysWhatIsKeptAndWhatIsComputedAgain) {
  Program p = pushed(10);
  Derivative d = propagate_adjoints(p.loss, {.checkpoint_states = 3});
  EXPECT_EQ(
      details_of(d.explanations(), Fact::Version),
      std::vector<std::string>{
          "update 0 is a loop of 10 steps that \"pushed_u_checkpoints\" runs backward: from 3 "
          "kept states of 28 bytes, 15 steps recomputed beside the 10 that are reversed"});
}

TEST(Checkpoints, ALoopOfOneStepNeedsNoCheckpointAndIsNoError) {
  Program p = number(1);
  expect_gradient(p.loss, p.inputs[0], {.checkpoint_states = 3});
}

// Spatial extents and the gradient by a Param may be known at run time only.
TEST(Checkpoints, SpaceMayHaveExtentsOfRunTime) {
  Param<int> width("width");
  Param<float> gain("gain");
  width.set(6);
  gain.set(0.75f);
  Buffer<float> start = line(6);
  Func u("sized_u"), loss("loss");
  RDom r(1, width - 2, 0, 5), s(0, width);
  u(x) = start(clamp(x, 0, 5));
  u(r.x) = gain * sin(u(r.x - 1)) + 0.25f * u(r.x + 1) * u(r.x);
  loss() = 0.0f;
  loss() += u(s) * u(s);
  Derivative d = propagate_adjoints(loss, {.checkpoint_states = 2});
  Derivative stored = propagate_adjoints(loss, {.overwritten = Overwritten::Store});
  EXPECT_EQ(values_of(d(start), start, true), values_of(stored(start), start, true));
  double by_gain = evaluate_scalar(d(gain));
  EXPECT_NEAR(by_gain, evaluate_scalar(stored(gain)), 1e-12 * std::abs(by_gain));
  EXPECT_NEAR(Buffer<float>(d(gain).realize())(), by_gain, 1e-5 * std::abs(by_gain));
  expect_error({"size of a state", "run time only", "checkpoint_states"},
               [&] { propagate_adjoints(loss, {.checkpoint_bytes = 1000}); });
}

// ---- a number of steps that is known at run time only ----

// Bits are the same as with a constant number of steps, for every number and every budget.
TEST(Checkpoints, TheNumberOfStepsMayBeAParam) {
  Buffer<float> start = line(5), gain = line(1, 7);
  auto loss_of = [&](const Expr& n) {
    Func u("run_time_u");
    RDom t(0, n);
    u(x) = start(x);
    u(x) = u(x) * gain(Expr(0)) + 0.25f * sin(u(x) + cast<float>(t));
    return weighted_sum(u, {5});
  };
  for (int s : {1, 2, 3, 40}) {
    Param<int> n("n");
    Derivative d = propagate_adjoints(loss_of(n), {.checkpoint_states = s});
    Func by_start = d(start), by_gain = d(gain);
    for (int steps : {0, 1, 2, 3, 4, 7, 30}) {
      SCOPED_TRACE(text(steps, " steps, ", s, " states"));
      n.set(steps);
      Derivative constant = propagate_adjoints(loss_of(steps), {.checkpoint_states = s});
      for (bool exact : {true, false}) {
        EXPECT_EQ(values_of(by_start, start, exact), values_of(constant(start), start, exact));
      }
      std::vector<double> expected = values_of(constant(gain), gain, false);
      EXPECT_NEAR(values_of(by_gain, gain, false)[0], expected[0], 1e-10 * std::abs(expected[0]));
      Buffer<float> found = by_start.realize({5}), same = constant(start).realize({5});
      for (int i = 0; i < 5; ++i) EXPECT_EQ(found(i), same(i));
    }
    n.set(6);
    expect_gradient(loss_of(n), d, start);
  }
}

// A row that every step sweeps in place, once for each row of an image, with a force for each step.
TEST(Checkpoints, TheNumberOfStepsMayBeAnExtentOfAnInput) {
  ImageParam force(Float(32), 2, "force");
  Buffer<float> start = line(8), weights = line(2, 4);
  Func u("swept_as_often");
  RDom r(1, 6, 0, force.dim(1).extent());
  u(x) = start(x);
  u(r.x) =
      weights(Expr(0)) * 0.25f * sin(u(r.x - 1)) * u(r.x + 1) + weights(Expr(1)) * force(r.x, r.y);
  Func loss = weighted_sum(u, {8});
  Derivative d = propagate_adjoints(loss, {.checkpoint_states = 2});
  Derivative stored = propagate_adjoints(loss, {.overwritten = Overwritten::Store});
  for (int rows : {1, 4, 9}) {
    Buffer<float> forces = plane(8, rows, 9);
    force.set(forces);
    EXPECT_EQ(values_of(d(start), start, true), values_of(stored(start), start, true));
    EXPECT_EQ(values_of(d(force), forces, true), values_of(stored(force), forces, true));
    expect_gradient(loss, d, weights);
  }
}

TEST(Checkpoints, AtRunTimeStepsAreComputedAgainAsOftenAsTheBinomialBoundSays) {
  Buffer<float> start = line(1);
  for (int s : {1, 2, 3, 10, 100}) {
    Param<int> n("n");
    Derivative d = propagate_adjoints(counted(start, n), {.wrt = {start}, .checkpoint_states = s});
    Func gradient = d(start);
    for (int steps = 1; steps < 60; steps += steps < 12 ? 1 : 9) {
      n.set(steps);
      evaluations = 0;
      gradient.realize({1});
      EXPECT_EQ(evaluations, steps + autodiff::revolve_advances(steps, s) + steps)
          << steps << " steps, " << s << " states";
    }
  }
}

TEST(Checkpoints, AtRunTimeMemoryIsThatOfTheStatesAndOfTheTable) {
  Buffer<float> start = line(1000);
  Param<int> n("n");
  auto peak = [&](int steps) {
    Func u("remembered_u");
    RDom t(0, n);
    u(x) = start(x);
    u(x) = u(x) + 0.125f * sin(u(x) + cast<float>(t));
    n.set(steps);
    return peak_memory(
        propagate_adjoints(weighted_sum(u, {1000}), {.wrt = {start}, .checkpoint_states = 10}),
        start);
  };
  // 12 bytes for each of at most 3 n + 4 n rows.
  EXPECT_LT(peak(200), peak(100) + 7 * 12 * 100 + 100);
}

TEST(Checkpoints, MoreStepsAtRunTimeThanATableMayHaveFailTheCall) {
  Param<int> n("n");
  Buffer<float> start = line(1);
  Derivative d = propagate_adjoints(counted(start, n), {.wrt = {start}, .checkpoint_states = 1});
  n.set(100000);
  expect_error<RuntimeError>(
      {"room for 1 kept state has at most 5789 steps", "this one has 100000", "larger budget"},
      [&] { d(start).realize({1}); });
  EXPECT_EQ(
      details_of(d.explanations(), Fact::Version),
      std::vector<std::string>{
          "update 0 is a loop of n steps that \"counted_u_checkpoints\" runs backward: from 1 "
          "kept state of 4 bytes, each step at most r times, as \"counted_u_actions\" finds at "
          "run time, recomputed beside the n that are reversed"});
}

// ---- refusals ----

// With two states, each of the four million steps would be recomputed some ten thousand times.
TEST(Checkpoints, SchedulesOfTooManyStepsAreErrors) {
  Buffer<float> start = line(7);
  Func u("u");
  RDom t(0, 1 << 22);
  u(x) = start(x);
  u(x) = u(x) + 0.125f * sin(u(x) + cast<float>(t));
  const Func loss = weighted_sum(u, {7});
  expect_error({"a schedule has at most", "4194304 steps", "larger budget"},
               [&] { propagate_adjoints(loss, {.checkpoint_states = 2}); });
}

TEST(Checkpoints, BudgetsThatCannotBeMetAreErrors) {
  Program p = pushed(5);
  auto message = [&](const AdjointOptions& options) {
    return error_of([&] { propagate_adjoints(p.loss, options); });
  };
  expect_mentions(message({.checkpoint_states = 0}), {"at least one kept state", "0 states"});
  expect_mentions(message({.checkpoint_bytes = -4}), {"at least one kept state", "-4 bytes"});
  expect_mentions(message({.checkpoint_states = 2, .checkpoint_bytes = 100}), {"Set one of them"});
  expect_mentions(message({.checkpoint_bytes = 27}), {"28 bytes", "the budget is 27"});
  expect_error({"100000 steps with room for 1 state ", "larger budget"},
               [] { propagate_adjoints(pushed(100000).loss, {.checkpoint_states = 1}); });
}

TEST(Checkpoints, PlacesThatDependOnForgottenValuesAreRefused) {
  Buffer<float> start = line(5), table = line(8, 6);
  Func u("placed_u");
  RDom t(0, 4);
  u(x) = start(x);
  u(x) = u(x) * 0.5f + table(clamp(cast<int>(u(x) * 2.0f) + t, 0, 7));
  expect_error<Unsupported>({"forgets the values", "Leave out the budget"}, [&] {
    propagate_adjoints(weighted_sum(u, {5}), {.checkpoint_states = 2});
  });
}

}  // namespace
}  // namespace retrograde::gradient
