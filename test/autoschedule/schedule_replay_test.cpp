// Tests that the default schedule of a gradient can be replayed: its log of directives, written as text, parsed and
// applied to a fresh build of the same program, gives the same loop nests.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>

#include "autodiff/derivative.h"
#include "driver/schedule.h"
#include "frontend/language/boundary_conditions.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"
#include "graph/directives/wrappers.h"
#include "graph/graph.h"
#include "graph/names.h"
#include "support/same_numbers.h"

namespace retrograde {
namespace {

using Program = std::vector<Func>;  // outputs
struct Case {
  const char* name;
  std::function<Program()> build;
};

Program conv_layer() {
  Var x("x"), y("y"), c("c");
  ImageParam image(Float(32), 3, "image"), filter(Float(32), 4, "filter"),
      bias(Float(32), 1, "bias");
  ImageParam seed(Float(32), 3, "seed");
  Func layer("layer"), out("out");
  RDom r(0, 3, 0, 3, 0, 16);
  layer(x, y, c) = bias(c);
  layer(x, y, c) += filter(r.x, r.y, r.z, c) * image(x + r.x, y + r.y, r.z);
  out(x, y, c) = max(0.0f, layer(x, y, c));
  const Derivative d = propagate_adjoints(out, seed, {{0, 64}, {0, 48}, {0, 16}});
  return {d(image), d(filter), d(bias)};
}

Program blur() {
  Var x("x"), y("y");
  ImageParam image(Float(32), 2, "image"), weights(Float(32), 1, "weights");
  Func inside = BoundaryConditions::repeat_edge(image), rows("rows"), columns("columns");
  RDom k(-2, 5), r(0, 640, 0, 480);
  rows(x, y) += inside(x + k, y) * weights(k + 2);
  columns(x, y) += rows(x, y + k) * weights(k + 2);
  Func loss("loss");
  loss() += columns(r.x, r.y) * columns(r.x, r.y);
  const Derivative d = propagate_adjoints(loss, {.wrt = {image, weights}});
  return {loss, d(image), d(weights)};
}

Program look_up() {
  Var x("x"), y("y"), i("i");
  ImageParam image(Float(32), 2, "image"), table(Float(32), 1, "table");
  Func bins("bins"), shown("shown"), loss("loss");
  RDom r(0, 320, 0, 240), all(0, 64);
  bins(i) = 0.0f;
  bins(clamp(cast<int>(image(r.x, r.y)), 0, 63)) += image(r.x, r.y);
  shown(x, y) = table(clamp(cast<int>(image(x, y) * 2), 0, 255)) * image(x, y);
  loss() = 0.0f;
  loss() += bins(all) * bins(all);
  Func total("total");
  total() = loss();
  total() += shown(r.x, r.y) * shown(r.x, r.y);
  const Derivative d = propagate_adjoints(total, {.wrt = {image, table}});
  return {total, d(image), d(table)};
}

Program long_sum() {
  ImageParam image(Float(32), 1, "image");
  Func loss("loss");
  RDom r(0, 3000000);
  loss() = 0.0f;
  loss() += exp(image(r)) * image(r);
  return {loss, propagate_adjoints(loss, {.wrt = {image}})(image)};
}

std::vector<graph::FuncPtr> functions(const Program& program) {
  std::vector<graph::FuncPtr> result;
  for (const Func& f : program) result.push_back(f.function());
  return result;
}

std::string applied(const std::vector<graph::FuncPtr>& outputs) {
  return same_numbers(graph::to_text(graph::graph_of(graph::apply_wrappers(outputs))));
}

class ScheduleReplay : public ::testing::TestWithParam<Case> {};

TEST_P(ScheduleReplay, GivesTheSameLoopNests) {
  const Program program = GetParam().build(), again = GetParam().build();
  // The vectors of the machine for which the loop nests are compiled.
  const auto request = driver::request_for(get_jit_target_from_environment(), {});
  const auto scheduled = driver::schedule_unscheduled(functions(program), request);
  const ScheduleLog log = graph::schedule_log(scheduled);
  EXPECT_GT(log.size(), 5u);
  EXPECT_EQ(ScheduleLog::parse(log.to_text()), log);

  Pipeline pipeline(again);
  pipeline.apply_schedule(ScheduleLog::parse(log.to_text()));
  EXPECT_EQ(same_numbers(pipeline.schedule_log().to_text()), same_numbers(log.to_text()));
  EXPECT_EQ(applied(functions(again)), applied(scheduled));
  EXPECT_EQ(applied(driver::schedule_unscheduled(functions(again), request)), applied(scheduled))
      << "and nothing is left to schedule";
  EXPECT_EQ(same_numbers(pipeline.loop_nest()), same_numbers(Pipeline(program).loop_nest()));
}

// The schedule, printed as C++ and compiled here, must apply to names that this process numbers differently.
TEST(ScheduleOfAGradient, IsStatements) {
  const std::string file = std::string(RETROGRADE_TEST_DIR) + "/golden/schedule_log/gradient.inc";
  const Program first = conv_layer(), program = conv_layer();
  const auto scheduled = driver::schedule_unscheduled(functions(first));
  const ScheduleLog log = graph::schedule_log(scheduled);
  const std::string statements = same_numbers(log.to_cpp());
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(file) << statements;
  std::ifstream in(file);
  EXPECT_EQ(statements, std::string(std::istreambuf_iterator<char>(in), {}));

  const auto called = [&](const std::string& name) {
    for (const graph::FuncPtr& f : graph::topological_order(functions(program))) {
      if (graph::without_numbers(f->name) == name) return Func(f);
    }
    return Func();
  };
  Func layer = called("layer"), seed_im = called("seed_im"), out_adj = called("out_adj"),
       layer_adj = called("layer_adj"), image_adj = called("image_adj"),
       filter_adj_parts = called("filter_adj_parts"), filter_adj = called("filter_adj"),
       bias_adj_parts = called("bias_adj_parts"), bias_adj = called("bias_adj");
  ImageParam image;
  for (const auto& parameter : graph::parameters_of(functions(program))) {
    if (graph::without_numbers(parameter->name) == "image") image = ImageParam(parameter);
  }
#include "golden/schedule_log/gradient.inc"
  EXPECT_EQ(applied(functions(program)), applied(scheduled));
}

INSTANTIATE_TEST_SUITE_P(Gradients, ScheduleReplay,
                         ::testing::Values(Case{"conv_layer", conv_layer}, Case{"blur", blur},
                                           Case{"look_up", look_up}, Case{"long_sum", long_sum}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace retrograde
