// Runs every program of the gradient suite. Each input's gradient is compared, element by element, with central
// differences in double, which the interpreter evaluates; then the gradient is checked as machine code. Programs that
// overwrite values needed by their partials must be refused if the compiler may not keep the values.
//
// Every third program (every one in the fuzz preset) also runs through check_gradients, which compares adjoint, tangent
// and complex step in machine code. No two of these share their derivatives.
#include "gradient/programs_suite.h"
#include "checks/check_gradients.h"
#include "driver/schedule.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/schedule_log.h"
#include "graph/graph.h"
#include "support/plan_round_trip.h"
#include "support/program_counts.h"

namespace retrograde::gradient {
namespace {

class Suite : public ::testing::TestWithParam<size_t> {
 protected:
  Program program = programs().at(GetParam()).build();
};

TEST_P(Suite, GradientIsRight) {
  const AdjointOptions strict{.overwritten = Overwritten::Refuse};
  if (program.store_overwritten) {
    EXPECT_THROW(propagate_adjoints(program.loss, strict), UserError);
  }
  Derivative d = propagate_adjoints(program.loss);
  for (size_t i = 0; i < program.inputs.size(); ++i) {
    SCOPED_TRACE("input " + std::to_string(i));
    expect_gradient(program.loss, d, program.inputs[i]);
  }
}

TEST_P(Suite, GraphsAreTheirText) {
  std::vector<graph::FuncPtr> outputs{program.loss.function()};
  Derivative d = propagate_adjoints(program.loss);
  for (const Buffer<float>& input : program.inputs) outputs.push_back(d(input).function());
  const graph::Graph graph = graph::graph_of(outputs);
  graph::validate(graph, "propagate_adjoints");
  EXPECT_EQ(graph::difference(graph::parse_graph(graph::to_text(graph)), graph), "")
      << graph::to_text(graph);
  for (const graph::FuncPtr& f : graph.funcs) {
    // Funcs that several adjoints share belong to none of them.
    const bool is_shared = f->made && f->made->role == graph::Role::SharedValue;
    EXPECT_TRUE(!f->made || is_shared || !f->made->of.empty()) << f->name;
  }
}

// The schedule of a gradient also applies to a copy built from its text.
TEST_P(Suite, SchedulesAreReplayed) {
  std::vector<graph::FuncPtr> outputs{program.loss.function()};
  Derivative d = propagate_adjoints(program.loss);
  for (const Buffer<float>& input : program.inputs) outputs.push_back(d(input).function());
  const graph::Graph graph = graph::graph_of(outputs);
  const graph::Graph fresh = graph::parse_graph(graph::to_text(graph));
  const size_t own = graph::schedule_log(outputs).size();
  for (const graph::FuncPtr& f : graph.funcs) {
    graph::give_directive({f}, graph::ComputeAt{{{graph::LoopLevel::Kind::Root, "", "", -1}}});
    for (int s = 0; s < f->stage_count(); ++s) {
      if (f->stage(s).schedule.dims.empty()) continue;
      const graph::Dim outermost = f->stage(s).schedule.dims.back();
      graph::give_directive({f, s}, graph::SplitLoop{outermost.var, "ro", "ri", 4});
      if (!outermost.is_reduction)
        graph::give_directive({f, s}, graph::RunLoop{{"ro"}, ForType::Parallel});
    }
  }
  ScheduleLog log = graph::schedule_log(outputs);
  EXPECT_EQ(ScheduleLog::parse(log.to_text()), log);
  log.entries.erase(log.entries.begin(), log.entries.begin() + static_cast<long>(own));
  graph::apply_log(log, fresh.outputs);
  EXPECT_EQ(graph::difference(graph::graph_of(fresh.outputs), graph::graph_of(outputs)), "");
}

// The default schedule is a plan, in which no Func is opaque.
TEST_P(Suite, SchedulesArePlans) {
  std::vector<graph::FuncPtr> outputs{program.loss.function()};
  Derivative d = propagate_adjoints(program.loss);
  for (const Buffer<float>& input : program.inputs) outputs.push_back(d(input).function());
  const PlanRoundTrip trip = plan_round_trip(driver::schedule_unscheduled(outputs));
  EXPECT_EQ(trip.failure, "");
  EXPECT_EQ(trip.broken, "");
  EXPECT_TRUE(trip.opaque.empty());
}

class CheckedSuite : public Suite {};

TEST_P(CheckedSuite, AdjointTangentAndComplexStepAgree) {
  GradientReport report = check_gradients(program.loss, {}, {.directions = 1, .smallest_step = 14});
  for (const auto& input : report.inputs) {
    EXPECT_LT(input.complex_step_error, 1e-11) << report.to_json();
    EXPECT_LT(input.dot_product_error, 1e-11) << report.to_json();
    EXPECT_LT(input.own_precision_error, 1e-4) << report.to_json();
  }
}

constexpr size_t step_of_checked = many_or_few(1, 3);

std::string name_of(const ::testing::TestParamInfo<size_t>& info) {
  return programs()[info.param].name;
}

INSTANTIATE_TEST_SUITE_P(Programs, Suite, ::testing::Range<size_t>(0, programs().size()), name_of);

INSTANTIATE_TEST_SUITE_P(Programs, CheckedSuite,
                         ::testing::Range<size_t>(0, programs().size(), step_of_checked), name_of);

}  // namespace
}  // namespace retrograde::gradient
