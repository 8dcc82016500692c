// The text of graphs: parse_graph(to_text(g)) equals g, for programs written for this test, for
// random ones under random schedules, and for gradients (gradient_suite_test). Violated rules are
// named.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include "diagnostics/error.h"
#include "graph/graph.h"
#include "support/errors.h"
#include "testing/random_schedule.h"

namespace retrograde {
namespace {

using graph::difference;
using graph::Graph;
using graph::graph_of;
using graph::parse_graph;
using graph::to_text;

void expect_round_trip(const std::vector<graph::FuncPtr>& outputs) {
  const Graph graph = graph_of(outputs);
  const std::string text = to_text(graph);
  const Graph again = parse_graph(text);
  EXPECT_EQ(difference(graph, again), "") << text << "\nread back as\n" << to_text(again);
  graph::validate(graph, "test");
  graph::validate(again, "parse_graph");
}

const char* const blur = R"(image uint8 input(2)
  dim(0, 0, _, 1)
  finite
param float32 gain
  value 1.5f
  at_least 0f
  finite
func in32(x, y) float32
  define
    value float32(image input(x, y))
  schedule
    compute_at(loop(blur, y, 1))
    store_at(root)
    align_storage(x, 8)
func blur(x, y) float32
  define
    value 0f
    split(x, xo, xi, 8, GuardWithIf)
    run(xi, Vectorized)
    specialize gain == 1f
      split(x, xo, xi, 16, GuardWithIf)
      run(xi, Unrolled)
    end
  update
    place x
    place y
    loop(r.x, 0, 3)
    where r.x < y
    value blur(x, y) + in32(x + r.x, y) * gain
    run(y, Parallel)
output blur
)";

TEST(GraphText, PrintsWhatItReads) {
  const Graph graph = parse_graph(blur);
  graph::validate(graph, "parse_graph");
  EXPECT_EQ(to_text(graph), blur);
  EXPECT_EQ(graph.funcs.size(), 2u);
  EXPECT_EQ(graph.parameters.size(), 2u);
}

TEST(GraphText, AParsedGraphRuns) {
  const Graph graph = parse_graph(R"(func slope(x) int32
  define
    value (3 * x)
func out(x) int32
  define
    value slope(x + 1) - slope(x)
  update
    place 2
    value 40
output out
)");
  Buffer<int> result = Func(graph.outputs[0]).realize({4});
  EXPECT_EQ(result(0), 3);
  EXPECT_EQ(result(2), 40);
}

TEST(GraphText, WhatTheFrontEndWritesIsItsText) {
  ImageParam input(UInt(8), 2, "gt_input");
  input.dim(0).set_bounds(0, 64).dim(1).set_stride(Expr());
  input.set_host_alignment(16);
  Param<float> gain("gt_gain", 1.5f, 0.0f, 4.0f);
  Buffer<float> weights(3);
  Var x("x"), y("y"), xi("xi"), yi("yi"), u("u");
  RDom r(0, 8, 0, input.width());
  r.where(r.x < r.y + 2);
  Func f("gt_f"), g("gt_g"), h("gt_h"), pair("gt_pair");
  f(x, y) = cast<float>(input(clamp(x, 0, 63), y)) * gain + weights(x % 3);
  g(x, y) = 0.0f;
  g(x, y) += f(x + r.x, y + r.y) * random_float();
  pair(x, y) = Tuple(g(x, y), f(x, y) > 2.0f);
  pair(x, 0) = Tuple(pair(x, 0)[0] + 1.0f, pair(x, 1)[1]);
  h(x, y) = select(pair(x, y)[1], pair(x, y)[0], -f(x, y));
  f.compute_at(h, y).store_root().fold_storage(y, 4).align_bounds(x, 4, 1);
  g.compute_root().update().rfactor(r.y, u).compute_root().vectorize(x, 8);
  f.in(h).compute_at(h, y).memoize();
  input.in(f).compute_root();
  f.copy_input(weights).compute_at(f, y);
  pair.clone_in(h).compute_root().async();
  h.tile(x, y, xi, yi, 8, 4).vectorize(xi).parallel(y).prefetch(input, y, y, 2);
  h.specialize(gain > 2.0f).never_partition(x).unroll(yi);
  h.specialize_fail("no");
  h.bound(x, 0, 64).set_estimate(y, 0, 48).trace_stores().add_trace_tag("a \"tag\"\n");
  h.output_buffer().dim(0).set_min(0);
  expect_round_trip({h.function()});
}

TEST(GraphText, ExternStagesAndRequirementsAreItsText) {
  ImageParam input(Float(32), 1, "gt_raw");
  Param<int> n("gt_n");
  Var x("x");
  Func source("gt_source"), outside("gt_outside"), out("gt_out");
  source(x) = input(x) + 1.0f;
  outside.define_extern("gt_call", {source, input, n + 1}, Float(32), {x}, NameMangling::C);
  out(x) = outside(x) * 2.0f;
  source.compute_root();
  Pipeline p(out);
  p.add_requirement(n > 2, "n is", n);
  expect_round_trip({out.function()});
}

TEST(GraphText, RandomPipelinesUnderRandomSchedulesAreTheirText) {
  for (uint64_t seed = 1; seed <= 150; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    fuzz::Choices choices(seed);
    const auto program = fuzz::make_program(choices, fuzz::Style::pipelines());
    fuzz::apply(fuzz::random_schedule(program, choices), program);
    expect_round_trip(fuzz::outputs_of(program));
    if (HasFailure()) return;
  }
}

TEST(GraphText, DifferencesAreNamed) {
  std::string other = blur;
  other.replace(other.find("1.5f"), 4, "2.5f");
  EXPECT_EQ(difference(parse_graph(blur), parse_graph(other)),
            "param float32 gain: value 1.5f and value 2.5f");
  other = blur;
  other.replace(other.find("GuardWithIf"), 11, "RoundUp");
  EXPECT_EQ(difference(parse_graph(blur), parse_graph(other)),
            "func blur(x, y) float32, define: split(x, xo, xi, 8, GuardWithIf) and "
            "split(x, xo, xi, 8, RoundUp)");
}

std::string with(const std::string& from, const std::string& to) {
  std::string changed = blur;
  changed.replace(changed.find(from), from.size(), to);
  return changed;
}

TEST(GraphText, BadTextSaysWhere) {
  expect_error({"it names its outputs"}, [] { parse_graph(with("output blur\n", "")); });
  expect_error({"a Func of the graph", "must stand here"},
               [] { parse_graph(with("output blur", "output blurr")); });
  expect_error({"should be a name"},
               [] { parse_graph(with("split(x, xo, xi, 8", "split(x, xo, 8")); });
  expect_error({"one of the choices", "its arguments are those of directive.h"},
               [] { parse_graph(with("GuardWithIf", "Guard")); });
  expect_error({"line 17"}, [] { parse_graph(with("    value 0f", "    vallue 0f")); });
}

TEST(GraphText, WhatIsReadIsThere) {
  const char* const rule = "every Func and image that is read belongs to the graph";
  expect_error({rule, "no image of it is called \"other\""},
               [] { parse_graph(with("image input(x, y)", "image other(x, y)")); });
  expect_error({rule, "no Func of it is called \"other\""},
               [] { parse_graph(with("in32(x + r.x, y)", "other(x, y):float32")); });
}

// A name without a declaration has type int32, which rarely fits.
TEST(GraphText, UnknownNamesAreBlamedBeforeTheirTypes) {
  const char* const rule = "every Func and image that is read belongs to the graph";
  expect_error({rule, "no Func of it is called \"other\""},
               [] { parse_graph(with("in32(x + r.x, y)", "other(x, y)")); });
  expect_error({rule, "no Func of it is called \"an other\""},
               [] { parse_graph(with("where r.x < y", "where `an other`(x) < 1f")); });
  expect_error({rule, "no image of it is called \"other\""},
               [] { parse_graph(with("in32(x + r.x, y)", "image other(x, y)")); });
  expect_error({"operands must fit each other"},
               [] { parse_graph(with("in32(x + r.x, y)", "image input(x, y)")); });
}

TEST(GraphText, BrokenGraphsAreBlamedOnThePass) {
  const auto expect_broken = [](const std::string& text, const char* rule) {
    const Graph graph = parse_graph(text);
    const auto check = [&] { graph::validate(graph, "some_pass"); };
    expect_error<InternalError>({rule, "some_pass"}, check);
  };
  expect_broken(with("value 0f", "value 0"), "values have the types of the Func");
  expect_broken(with("in32(x + r.x, y)", "in32(x + r.x)"), "a coordinate for each dimension");
  expect_broken(with("in32(x + r.x, y)", "float32(in32(x + r.x, y):uint8)"),
                "the type of the value that it reads");
  expect_broken(with("r.x < y", "r.x < z"), "a variable belongs to its definition");
  expect_broken(with("where r.x < y", "where r.x"), "predicates are of type bool");
}

}  // namespace
}  // namespace retrograde
