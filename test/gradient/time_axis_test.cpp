// Tests checkpointing of loops over time that store every step along an axis of its own, if only the last steps are
// read. Such loops run backward from a few kept states. Oracles: central differences; the gradient without a budget,
// bit by bit; the memory that the profiler reports.
#include "gradient/programs_suite.h"
#include "support/facts.h"
#include "support/variables.h"

namespace retrograde::gradient {
namespace {

Program at_own_place(int n) {
  Buffer<float> start = line(7), force = plane(7, n, 4);
  Func u("u"), last("last");
  RDom r(0, n);
  u(x, t) = 0.0f;
  u(x, 0) = start(x);
  u(x, r + 1) = u(x, r) + 0.25f * (force(x, r) - sin(u(x, r)));
  last(x) = u(x, n);
  return {weighted_sum(last, {7}), {start, force}};
}

// Every element of an image is the start of its own scan: its pure definition is overwritten.
Program filter_along_an_image(int n) {
  Buffer<float> image = plane(5, n + 1, 4), c = line(2, 6);
  Func f("f"), last("last");
  RDom r(1, n);
  f(x, y) = image(x, y);
  f(x, r) = c(Expr(0)) * f(x, r) + 0.5f * c(Expr(1)) * sin(f(x, r - 1));
  last(x) = f(x, n);
  return {weighted_sum(last, {5}), {image, c}};
}

Program two_steps_back(int n) {
  Buffer<float> start = plane(6, 2, 4), speed = line(6, 5);
  Func u("u"), last("last");
  RDom r(1, n);
  u(x, t) = start(x, clamp(t, 0, 1));
  u(x, r + 1) = 2.0f * u(x, r) - u(x, r - 1) - 0.25f * speed(x) * sin(u(x, r));
  last(x) = u(x, n + 1);
  return {weighted_sum(last, {6}), {start, speed}};
}

// Elements at the border are 0 at every step except the first.
Program stencil_with_a_border(int n) {
  Buffer<float> start = line(9), k = line(9, 3);
  Func u("u"), last("last");
  RDom r(1, 7, 0, n);
  u(x, t) = 0.125f;
  u(x, 0) = start(x);
  Expr here = u(r.x, r.y);
  u(r.x, r.y + 1) =
      here + 0.25f * k(r.x) * (u(r.x - 1, r.y) - 2.0f * here + u(r.x + 1, r.y)) * here;
  last(x) = u(x, n);
  return {weighted_sum(last, {9}), {start, k}};
}

// The last two steps of a Tuple are read through other Funcs.
Program tuple_and_its_last_difference(int n) {
  Buffer<float> angle = line(5), gravity = line(5, 9);
  Func u("u"), energy("energy"), end("end");
  RDom r(0, n);
  u(x, t) = Tuple(angle(x), 0.0f);
  Expr speed = u(x, r)[1] - 0.25f * gravity(x) * sin(u(x, r)[0]);
  u(x, r + 1) = Tuple(u(x, r)[0] + 0.25f * speed, speed);
  energy(x) = u(x, n)[1] * u(x, n)[1] + u(x, n)[0];
  end(x) = energy(x) + gravity(x) * (u(x, n)[0] - u(x, n - 1)[0]);
  return {weighted_sum(end, {5}), {angle, gravity}};
}

Program backward_in_time(int n) {
  Buffer<float> reward = plane(6, n, 4), end = line(6, 4);
  Func v("v"), first("first");
  RDom r(0, 6, 0, n);
  v(x, t) = end(x);
  Expr now = n - 1 - r.y;
  v(r.x, now) = reward(r.x, now) + 0.5f * sin(v(r.x, now + 1)) * v((r.x + 1) % 6, now + 1);
  first(x) = v(x, 0);
  return {weighted_sum(first, {6}), {reward, end}};
}

// Each step sweeps a row in place: reads of this step and of the one before.
Program sweep_within_a_step(int n) {
  Buffer<float> start = line(8), w = line(3, 4);
  Func u("u"), last("last");
  RDom r(1, 6, 0, n);
  u(x, t) = start(x);
  u(r.x, r.y + 1) = 0.25f * w(Expr(0)) * u(r.x - 1, r.y + 1) + 0.25f * sin(u(r.x, r.y)) +
                    0.125f * w(Expr(1)) * u(r.x + 1, r.y);
  last(x) = u(x, n);
  return {weighted_sum(last, {8}), {start, w}};
}

// The second loop starts where the first one ends.
Program one_loop_after_another(int n) {
  Buffer<float> start = line(5), gain = random_image({5}, 0.25, 0.75, 7);
  Func u("u"), v("v"), last("last");
  RDom r(0, n), s(0, n + 1);
  u(x, t) = start(x);
  u(x, r + 1) = u(x, r) * gain(x) + 0.25f * sin(u(x, r));
  v(x, t) = u(x, n);
  v(x, s + 1) = cos(v(x, s)) * gain(x);
  last(x) = v(x, n + 1);
  return {weighted_sum(last, {5}), {start, gain}};
}

// Repeated multiplication by a matrix: several iterations accumulate into one element.
Program power_of_a_matrix(int n) {
  Buffer<float> m = random_image({3, 3}, -1, 1, 12), start = line(3);
  Func v("v"), last("last");
  RDom r(0, 3, 0, 3, 0, n);
  v(x, t) = select(t == 0, start(clamp(x, 0, 2)), 0.0f);
  v(r.y, r.z + 1) += m(r.x, r.y) * sin(v(r.x, r.z));
  last(x) = v(x, n);
  return {weighted_sum(last, {3}), {start, m}};
}

// A loop over time that keeps only its last steps.
struct FoldedLoop {
  std::string func;
  int kept, state_bytes;  // kept steps; bytes of a state
  int steps = 6, recomputed = 8;

  std::vector<std::string> facts() const {
    return {
        text("only its last steps are read: \"", func, "_folded\" keeps ", kept,
             kept == 1 ? " of them" : " of them in turn", " and has the adjoint; \"", func,
             "\" has none"),
        text("update 0 is a loop of ", steps, " steps that \"", func,
             "_folded_checkpoints\" runs backward: from 2 kept states of ", state_bytes, " bytes, ",
             recomputed, " steps recomputed beside the ", steps, " that are reversed")};
  }
};

struct FoldedProgram {
  NamedLoop program;
  std::vector<FoldedLoop> loops;
};

const FoldedProgram cases[] = {
    {{"at_own_place", at_own_place}, {{"u", 1, 28}}},
    {{"filter_along_an_image", filter_along_an_image}, {{"f", 1, 20}}},
    {{"two_steps_back", two_steps_back}, {{"u", 2, 48}}},
    {{"stencil_with_a_border", stencil_with_a_border}, {{"u", 2, 72}}},
    {{"tuple_and_its_last_difference", tuple_and_its_last_difference}, {{"u", 2, 80}}},
    {{"backward_in_time", backward_in_time}, {{"v", 2, 48}}},
    {{"sweep_within_a_step", sweep_within_a_step}, {{"u", 2, 64}}},
    {{"one_loop_after_another", one_loop_after_another}, {{"u", 1, 20}, {"v", 1, 20, 7, 11}}},
    {{"power_of_a_matrix", power_of_a_matrix}, {{"v", 2, 24}}}};

TEST(TimeAxis, GradientsAgreeWithCentralDifferences) {
  for (const FoldedProgram& c : cases) {
    SCOPED_TRACE(c.program.name);
    Program p = c.program.build(6);
    Derivative d = propagate_adjoints(p.loss, {.checkpoint_states = 2});
    std::vector<std::string> expected, found = details_of(d.explanations(), Fact::Version);
    for (const FoldedLoop& loop : c.loops) std::ranges::copy(loop.facts(), back_inserter(expected));
    std::ranges::sort(expected);
    std::ranges::sort(found);
    EXPECT_EQ(found, expected);
    for (Buffer<float>& input : p.inputs) expect_gradient(p.loss, d, input);
  }
}

std::vector<float> gradient_of(const Derivative& d, const Buffer<float>& input) {
  oracle::Region region = oracle::region_of(*input.raw_buffer());
  oracle::Array array = oracle::Interpreter(oracle::InterpreterOptions{})
                            .realize(d(input).function(), region)
                            .front();
  std::vector<float> result;
  for (const oracle::Value& v : array.values)
    result.push_back(static_cast<float>(v.scalar.as_double()));
  return result;
}

// In float32, bits agree operation by operation with the gradient that keeps all steps. Gradients by inputs that every
// step reads are summed in another order.
TEST(TimeAxis, GradientsAreThoseOfAllStepsKept) {
  for (const FoldedProgram& c : cases) {
    for (int n : {1, 2, 3, 12}) {
      Program p = c.program.build(n);
      Derivative all = propagate_adjoints(p.loss, {.overwritten = Overwritten::Store});
      for (int s : {1, 3, 20}) {
        SCOPED_TRACE(text(c.program.name, ", ", n, " steps, ", s, " states"));
        Derivative d = propagate_adjoints(p.loss, {.checkpoint_states = s});
        for (const Buffer<float>& input : p.inputs) {
          std::vector<float> found = gradient_of(d, input), expected = gradient_of(all, input);
          for (size_t i = 0; i < found.size(); ++i)
            EXPECT_NEAR(found[i], expected[i], 4e-6 * (1 + std::abs(expected[i])));
        }
      }
    }
  }
}

// A loop of random shape: its reads, the elements that it writes, their initial values, the direction of time, and the
// steps that are read at the end are all random.
Program random_loop(unsigned seed) {
  std::mt19937 random(seed);
  auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const int width = 7, n = 1 + pick(6), lags = 1 + pick(2), margin = pick(3);
  const bool in_rows = pick(3) > 0, forward = pick(3) > 0;
  Buffer<float> start = plane(width, n + 4, seed), k = random_image({3}, 0.25, 0.5, seed + 1);
  Func u("u"), last("last");
  RDom r(margin, width - 2 * margin, 0, n);
  // Time steps lags to lags + n - 1 are written, or n - 1 to 0.
  Expr time = forward ? r.y + lags : n - 1 - r.y, place = in_rows ? Expr(r.x) : Expr(x);
  auto back = [&](int steps) { return forward ? time - steps : time + steps; };
  const int before = forward ? lags - 1 : n, end = forward ? lags + n - 1 : 0;
  switch (pick(3)) {
    case 0:
      u(x, t) = start(clamp(x, 0, width - 1), clamp(t, 0, n + 3));
      break;
    case 1:
      u(x, t) = 0.25f;
      u(x, before) = start(clamp(x, 0, width - 1), 0);
      break;
    default:
      u(x, t) = start(clamp(x, 0, width - 1), 1) * 0.5f;
  }
  auto near = [&](int reach) {
    return in_rows ? clamp(place + pick(2 * reach + 1) - reach, 0, width - 1) : place;
  };
  Expr value = k(0) * sin(u(near(2), back(1))) + k(1) * u(near(1), back(1 + pick(lags)));
  if (pick(2)) value = value + k(2) * u(place, time);
  if (pick(2)) value = value * cos(u(place, back(lags)));
  if (in_rows && pick(3) == 0) value = value + 0.125f * u(max(place - 1, 0), time);
  u(place, time) = value;
  Expr earlier = forward ? Expr(end - 1) : Expr(end + 1);
  last(x) = pick(2) && n > 1 ? u(x, end) + 0.5f * u(x, earlier) : u(x, end);
  return {weighted_sum(last, {width}), {start, k}};
}

// A loop over time has become one that keeps only its last steps.
bool is_folded(const Derivative& d) {
  std::vector<graph::FuncPtr> generated;
  for (const Func& f : d.funcs()) generated.push_back(f.function());
  return std::ranges::any_of(graph::topological_order(generated), [](const graph::FuncPtr& f) {
    return f->made && f->made->role == graph::Role::TimeFold;
  });
}

TEST(TimeAxis, RandomLoopsAgreeWithThoseThatKeepAllSteps) {
  int folded = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(text("seed ", seed));
    Program p = random_loop(seed);
    Derivative all = propagate_adjoints(p.loss, {.overwritten = Overwritten::Store});
    Derivative d = propagate_adjoints(
        p.loss, {.overwritten = Overwritten::Store, .checkpoint_states = 1 + int(seed % 3)});
    folded += is_folded(d);
    for (const Buffer<float>& input : p.inputs) {
      ASSERT_EQ(d.has(input), all.has(input)) << d.explain(Detail::All) << all.explain(Detail::All);
      if (!d.has(input)) continue;  // not read
      oracle::Region region = oracle::region_of(*input.raw_buffer());
      oracle::Array found = evaluate(d(input), region), expected = evaluate(all(input), region);
      for (size_t i = 0; i < found.values.size(); ++i) {
        const double e = expected.values[i].scalar.as_double();
        EXPECT_NEAR(found.values[i].scalar.as_double(), e, 1e-9 * (1 + std::abs(e)));
      }
    }
  }
  EXPECT_GT(folded, 30);
}

// Memory is one slice for each kept state, regardless of the number of steps: the loss, which is not linear, reads the
// last step too.
TEST(TimeAxis, MemoryIsThatOfTheKeptSlices) {
  Buffer<float> start = line(100);
  auto peak = [&](int n, int states) {
    Func u("u"), last("last");
    RDom r(0, n);
    u(x, t) = start(x);
    u(x, r + 1) = u(x, r) + 0.125f * sin(u(x, r) + cast<float>(r));
    last(x) = u(x, n);
    return peak_memory(propagate_adjoints(weighted_sum(last, {100}),
                                          {.wrt = {start}, .checkpoint_states = states}),
                       start);
  };
  int64_t ten = peak(500, 10);
  EXPECT_LT(ten, 24 * 400);
  EXPECT_EQ(peak(1000, 10), ten);
  EXPECT_EQ(peak(500, 20), ten + 10 * 400);
}

TEST(TimeAxis, TheNumberOfStepsMayBeAParam) {
  Buffer<float> c = line(9), a = random_image({5}, 0.25, 1, 6);
  Param<int> n("n");
  Func f("f"), last("last");
  RDom r(0, n);
  f(x, t) = 0.5f;
  f(x, r + 1) = f(x, r) * a(x) + c(clamp(n - 1 - r, 0, 8));
  last(x) = f(x, n);
  Func loss = weighted_sum(last, {5});
  Derivative d = propagate_adjoints(loss, {.checkpoint_states = 2});
  const std::vector<std::string> expected{
      "only its last steps are read: \"f_folded\" keeps 1 of them and has the adjoint; \"f\" has "
      "none",
      "update 0 is a loop of n steps that \"f_folded_checkpoints\" runs backward: from 2 kept "
      "states "
      "of 20 bytes, each step at most r times, as \"f_folded_actions\" finds at run time, "
      "recomputed "
      "beside the n that are reversed"};
  EXPECT_EQ(details_of(d.explanations(), Fact::Version), expected);
  for (int steps : {0, 1, 2, 9}) {
    SCOPED_TRACE(steps);
    n.set(steps);
    expect_gradient(loss, d, a);
    expect_gradient(loss, d, c);
  }
}

TEST(TimeAxis, TheGradientCanBeDifferentiatedAgain) {
  Buffer<float> start = line(2);
  Param<int> n("n");
  n.set(2);
  Func u("u"), last("last");
  RDom r(0, n);
  u(x, t) = start(x);
  u(x, r + 1) = u(x, r) + 0.25f * sin(u(x, r));
  last(x) = u(x, n);
  Derivative d = propagate_adjoints(weighted_sum(last, {2}), {.checkpoint_states = 2});
  expect_gradient(weighted_sum(d(start), {2}), start, {.overwritten = Overwritten::Store});
}

// Adjoints of Funcs between the loop and the output are found under the user's Funcs.
TEST(TimeAxis, FuncsBehindTheLoopHaveTheirAdjoints) {
  Func u("u"), last("last");
  Buffer<float> start = line(7);
  RDom r(0, 5);
  u(x, t) = start(x);
  u(x, r + 1) = u(x, r) + 0.25f * sin(u(x, r));
  last(x) = u(x, 5);
  Func loss = weighted_sum(last, {7});
  Derivative d = propagate_adjoints(loss, {.checkpoint_states = 2});
  Derivative all = propagate_adjoints(loss);
  ASSERT_TRUE(d(last).defined());
  EXPECT_THROW(d(u), CompileError) << d.explain(Detail::All);
  Buffer<float> found = d(last).realize({7}), expected = all(last).realize({7});
  for (int i = 0; i < 7; ++i) EXPECT_EQ(found(i), expected(i));
  // A request for the adjoint of every step is honoured, at the price of its memory.
  Derivative asked = propagate_adjoints(loss, {.wrt = {u}, .checkpoint_states = 2});
  EXPECT_TRUE(asked(u).defined());
}

// Data decide whether a step writes, so the compiler cannot know which slot holds which step.
TEST(TimeAxis, WithStepsThatDataSkipIsLeftAsItIs) {
  Buffer<float> start = line(5), gate = line(6, 4);
  Func u("u"), last("last");
  RDom r(0, 6);
  r.where(gate(r) > 1.0f);
  u(x, t) = start(x) * cast<float>(t + 1);
  u(x, r + 1) = u(x, r + 1) * 0.5f + 0.25f * sin(u(x, r));
  last(x) = u(x, 6);
  Func loss = weighted_sum(last, {5});
  Derivative d = propagate_adjoints(loss, {.checkpoint_states = 2});
  EXPECT_EQ(details_of(d.explanations(), Fact::Version),
            std::vector<std::string>{
                "update 0 is a loop of 6 steps that \"u_checkpoints\" runs backward: from 2 kept "
                "states of 140 bytes, 8 steps recomputed beside the 6 that are reversed"});
  expect_gradient(loss, d, start);
}

TEST(TimeAxis, WhoseEveryStepIsReadIsLeftAsItIs) {
  Buffer<float> start = line(5);
  Func u("u");
  RDom r(0, 6);
  u(x, t) = start(x);
  u(x, r + 1) = 0.5f * sin(u(x, r));
  Func loss = weighted_sum(u, {5, 7});
  Derivative d = propagate_adjoints(loss, {.checkpoint_states = 2});
  expect_fact(
      d.explanations(), Fact::Performance, u.name(),
      "update 0 needs no checkpoints: \"u\" keeps every step along a dimension of its own, so "
      "the budget for checkpoints is not used; written in place, as f(x) = g(f(x), t), it is "
      "run backward from kept states");
  expect_gradient(loss, d, start);
}

}  // namespace
}  // namespace retrograde::gradient
