// Properties of the prices of all plans: they are finite, the same ones each time, and they never fall when anything
// takes longer.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <iostream>

#include "frontend/data/param.h"
#include "testing/random_schedule.h"
#include "unit/cost/cost_testing.h"

namespace retrograde::planning {
namespace {

// The plans of random programs: their default schedules and random ones.
template <class Visit>
void for_each_random_plan(Visit visit) {
  for (int seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    fuzz::Choices choices(static_cast<uint64_t>(seed));
    const auto program = fuzz::make_program(
        choices, seed % 2 == 0 ? fuzz::Style::chains() : fuzz::Style::pipelines());
    fuzz::apply(fuzz::random_schedule(program, choices, fuzz::ScheduleStyle()), program);
    const auto outputs = graph::apply_wrappers(fuzz::outputs_of(program));
    visit(outputs, import_plan(outputs));
  }
}

void expect_equal(const Cost& a, const Cost& b) {
  EXPECT_EQ(a.seconds, b.seconds);
  EXPECT_EQ(a.peak_bytes, b.peak_bytes);
  ASSERT_EQ(a.stages.size(), b.stages.size());
  for (size_t s = 0; s < a.stages.size(); ++s) {
    EXPECT_EQ(a.stages[s].stage, b.stages[s].stage);
    EXPECT_EQ(a.stages[s].seconds, b.stages[s].seconds);
    EXPECT_EQ(a.stages[s].bytes, b.stages[s].bytes);
  }
}

TEST(CostOfPlans, IsFiniteAndTheSameEachTime) {
  for_each_random_plan([](const auto& outputs, const Plan& plan) {
    Pricing pricing(outputs), again(outputs);
    const Cost cost = pricing.price(plan);
    EXPECT_TRUE(std::isfinite(cost.seconds)) << to_text(plan);
    EXPECT_GT(cost.seconds, 0) << to_text(plan);
    EXPECT_GE(cost.peak_bytes, 0);
    for (const StageCost& stage : cost.stages) {
      EXPECT_GE(stage.compute_seconds, 0);
      EXPECT_GE(stage.seconds, stage.compute_seconds);
    }
    expect_equal(cost, pricing.price(plan));
    expect_equal(cost, again.price(plan));
  });
}

// Whether other Funcs are computed in its loops.
bool is_host(const Plan& plan, FuncId func) {
  return std::ranges::any_of(plan.funcs, [&](const auto& other) {
    const bool shares = std::ranges::any_of(other->nests, [&](const Nest& nest) {
      return nest.shared_with && nest.shared_with->stage.func == func;
    });
    return shares || (other->placement.compute.kind == Level::Kind::At &&
                      other->placement.compute.loop.stage.func == func);
  });
}

// A model that has priced other plans before gives what a new one gives.
TEST(CostOfPlans, IsThatOfAModelThatRemembersNothing) {
  for_each_random_plan([](const auto& outputs, const Plan& plan) {
    Pricing remembering(outputs);
    for (size_t f = 0; f < plan.funcs.size(); ++f) {
      const Level::Kind kind = plan.funcs[f]->placement.compute.kind;
      if (is_output(*plan.program, static_cast<FuncId>(f)) || kind == Level::Kind::At) continue;
      Plan other = plan;
      auto changed = std::make_shared<FuncPlan>(*plan.funcs[f]);
      const bool is_root = kind == Level::Kind::Root;
      if (is_root && (changed->nests.size() != 1 || changed->nests[0].shared_with)) continue;
      changed->placement.compute.kind = is_root ? Level::Kind::Inline : Level::Kind::Root;
      other.funcs[f] = changed;
      if (is_host(plan, static_cast<FuncId>(f)) || !broken_invariant(other).empty()) continue;
      expect_equal(remembering.price(other), Pricing(outputs).price(other));
    }
    expect_equal(remembering.price(plan), Pricing(outputs).price(plan));
  });
}

TEST(CostOfPlans, NeverFallsOnASlowerMachine) {
  std::vector<std::pair<const char*, void (*)(Machine&)>> slower{
      {"operations", [](Machine& m) { m.operation_ns *= 2; }},
      {"loads", [](Machine& m) { m.load_ns *= 2; }},
      {"stores", [](Machine& m) { m.store_ns *= 2; }},
      {"gathers", [](Machine& m) { m.gather_lane_ns *= 2; }},
      {"latency", [](Machine& m) { m.latency_ns *= 2; }},
      {"memory latency", [](Machine& m) { m.memory_latency_ns *= 2; }},
      {"iterations", [](Machine& m) { m.iteration_ns *= 2; }},
      {"launches", [](Machine& m) { m.launch_ns *= 2; }},
      {"bandwidth", [](Machine& m) { m.levels[3].one_thread = m.levels[3].all_threads /= 2; }},
      {"L2", [](Machine& m) { m.levels[2].all_threads /= 2; }},
      {"registers", [](Machine& m) { m.registers /= 2; }}};
  for_each_random_plan([&](const auto& outputs, const Plan& plan) {
    const double seconds = Pricing(outputs).price(plan).seconds;
    for (const auto& [what, change] : slower) {
      Machine machine = probed_machine();
      change(machine);
      EXPECT_GE(Pricing(outputs, machine).price(plan).seconds, seconds * (1 - 1e-12))
          << what << "\n"
          << to_text(plan);
    }
  });
}

// Larger programs of a kind, with an operation more each or not.
Cost priced_stencil(int columns, int rows, int operations, const std::string& text) {
  ImageParam in(Float(32), 2, "in");
  in.dim(0).set_estimate(0, columns + 2);
  in.dim(1).set_estimate(0, rows);
  Func blur("blur"), out("out");
  blur(x, y) = in(x, y) + in(x + 1, y);
  Expr value = blur(x, y) + blur(x, y + 1);
  for (int i = 0; i < operations; ++i) value = value * value + 1.0f;
  out(x, y) = value;
  out.set_estimate(x, 0, columns).set_estimate(y, 0, rows);
  return priced(out, text);
}

TEST(CostOfPlans, NeverFallsWithMoreElementsOrOperations) {
  for (const char* text :
       {"out  root  y, x:16, vector x\nblur  inline\n",
        "out  root  parallel y:8, y, x:16, vector x\nblur  at out/y:8  y, x:16, vector x\n",
        "out  root  parallel y, x:16, vector x\nblur  root  parallel y, x:16, vector x\n"}) {
    double least = 0, least_rows = 0;
    for (int size = 60; size < 6000; size += size / 3 + 1) {
      const double seconds = priced_stencil(size, 500, 1, text).seconds;
      EXPECT_GE(seconds, 0.999 * least) << text << size << " columns";
      EXPECT_GE(priced_stencil(size, 500, 2, text).seconds, seconds) << text << size;
      least = seconds;
      const double of_rows = priced_stencil(500, size, 1, text).seconds;
      EXPECT_GE(of_rows, 0.999 * least_rows) << text << size << " rows";
      least_rows = of_rows;
    }
  }
}

// ---- time ----

std::vector<Func> chain_of(int stages) {
  ImageParam in(Float(32), 2, "in");
  std::vector<Func> chain;
  for (int i = 0; i < stages; ++i) {
    Func next("stage_" + std::to_string(i));
    if (i == 0)
      next(x, y) = in(x, y);
    else
      next(x, y) = chain.back()(x - 1, y) + chain.back()(x + 1, y) * 0.5f;
    next.compute_root().vectorize(x, 16);
    chain.push_back(next);
  }
  chain.back().set_estimate(x, 0, 1000).set_estimate(y, 0, 1000);
  return chain;
}

TEST(CostOfPlans, OnlyChangedStagesArePricedAgain) {
  for (const int stages : {10, 100, 500}) {
    const std::vector<Func> chain = chain_of(stages);
    const auto outputs = functions({chain.back()});
    Plan plan = import_plan(outputs);
    Pricing pricing(outputs);
    const auto timed = [&] {
      const auto begin = std::chrono::steady_clock::now();
      pricing.price(plan);
      const std::chrono::duration<double, std::micro> taken =
          std::chrono::steady_clock::now() - begin;
      return taken.count();
    };
    const double first = timed(), again = timed();
    const size_t known = pricing.model.groups_priced();
    EXPECT_EQ(known, static_cast<size_t>(stages));
    auto changed = std::make_shared<FuncPlan>(*plan.funcs[static_cast<size_t>(stages / 2)]);
    changed->nests[0].loops[0].kind = ForType::Parallel;
    plan.funcs[static_cast<size_t>(stages / 2)] = changed;
    const double one = timed();
    EXPECT_EQ(pricing.model.groups_priced(), known + 1);
    changed = std::make_shared<FuncPlan>(*changed);
    changed->placement.compute.kind = Level::Kind::Inline;
    plan.funcs[static_cast<size_t>(stages / 2)] = changed;
    pricing.price(plan);
    EXPECT_EQ(pricing.model.groups_priced(), known + 2) << "the consumer";
    std::cout << stages << " stages: " << first << " us at first, " << one << " us after a change, "
              << again << " us unchanged\n";
  }
}

}  // namespace
}  // namespace retrograde::planning
