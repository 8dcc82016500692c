// trace_loads, trace_stores, trace_realizations: their events, and the text of these.
#include <HalideRuntime.h>
#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <vector>

#include "frontend/include/retrograde/retrograde.h"

namespace retrograde {
namespace {

// The output of the default handler, one string per line, with names without their numbers.
std::vector<std::string> trace_of(Func& f, const std::vector<int32_t>& sizes,
                                  const Target& target = Target()) {
  std::string all;
  f.jit_handlers().print = [&](const char* text) { all += text; };
  f.realize(sizes, target);
  std::vector<std::string> lines;
  std::string line;
  bool in_number = false;
  for (char c : all) {
    if (c == '$') in_number = true;
    if (in_number && (c == '$' || std::isdigit(static_cast<unsigned char>(c)))) continue;
    in_number = false;
    if (c == '\n') {
      lines.push_back(line);
      line.clear();
    } else {
      line += c;
    }
  }
  return lines;
}

TEST(Tracing, TextOfEveryEventIsHalides) {
  Var x("x"), y("y");
  Func f("f"), g("g");
  f(x, y) = Tuple(x + cast<float>(y) / 3.0f, cast<uint8_t>(x), cast<bool>(x > 0));
  g(x, y) = f(x, y)[0] + cast<float>(f(x, y + 1)[1]);
  g(x, y) += 1.0f;
  f.compute_root().trace_stores().trace_loads().trace_realizations();
  f.add_trace_tag("tag one");
  g.trace_stores().trace_loads().trace_realizations();
  const std::vector<std::string> expected = {
      "Begin pipeline g.0()",
      "Tag f.0() tag = \"func_type_and_dim: 3 2 32 1 1 8 1 1 1 1 2 0 1 0 2\"",
      "Tag g.0() tag = \"func_type_and_dim: 1 2 32 1 2 0 1 0 1\"",
      "Tag f.0() tag = \"tag one\"",
      "Begin realization g.0(0, 1, 0, 1)",
      "Begin realization f.0(0, 1, 0, 2)",
      "Produce f.0(0, 1, 0, 2)",
      "Store f.0(0, 0) = 0.000000",
      "Store f.1(0, 0) = 0",
      "Store f.2(0, 0) = 0",
      "Store f.0(0, 1) = 0.333333",
      "Store f.1(0, 1) = 0",
      "Store f.2(0, 1) = 0",
      "End produce f.0(0, 1, 0, 2)",
      "Consume f.0(0, 1, 0, 2)",
      "Produce g.0(0, 1, 0, 1)",
      "Load f.0(0, 0) = 0.000000",
      "Load f.1(0, 1) = 0",
      "Store g.0(0, 0) = 0.000000",
      "Load g.0(0, 0) = 0.000000",
      "Store g.0(0, 0) = 1.000000",
      "End produce g.0(0, 1, 0, 1)",
      "End consume f.0(0, 1, 0, 2)",
      "End realization f.0(0, 1, 0, 2)",
      "End realization g.0(0, 1, 0, 1)",
      "End pipeline g.0()"};
  EXPECT_EQ(trace_of(g, {1, 1}), expected);
}

TEST(Tracing, VectorsAreOneEvent) {
  Var x("x");
  Func f("f"), g("g");
  f(x) = cast<double>(x) * Expr(1e10);
  g(x) = cast<int16_t>(x) + cast<int16_t>(f(x) < 0.5);
  f.compute_root().vectorize(x, 4).trace_stores();
  g.vectorize(x, 4).trace_stores().trace_loads();
  const std::vector<std::string> expected = {
      "Begin pipeline g.0()",
      "Tag f.0() tag = \"func_type_and_dim: 1 2 64 1 1 0 8\"",
      "Tag g.0() tag = \"func_type_and_dim: 1 0 16 1 1 0 8\"",
      "Store f.0(<0, 1, 2, 3>) = <0.000000e+00, 1.000000e+10, 2.000000e+10, 3.000000e+10>",
      "Store f.0(<4, 5, 6, 7>) = <4.000000e+10, 5.000000e+10, 6.000000e+10, 7.000000e+10>",
      "Store g.0(<0, 1, 2, 3>) = <1, 1, 2, 3>",
      "Store g.0(<4, 5, 6, 7>) = <4, 5, 6, 7>",
      "End pipeline g.0()"};
  EXPECT_EQ(trace_of(g, {8}), expected);
}

TEST(Tracing, LanesThatAreOffAreNotTold) {
  Var x("x");
  Func f("f");
  f(x) = x;
  f.vectorize(x, 4, TailStrategy::GuardWithIf).trace_stores();
  int stored = 0;
  for (const std::string& line : trace_of(f, {7})) {
    if (line.rfind("Store", 0) != 0) continue;
    stored += line.find('<') == std::string::npos ? 1 : 4;
    EXPECT_EQ(line.find("7"), std::string::npos) << line;
  }
  EXPECT_EQ(stored, 7);
}

TEST(Tracing, FeaturesOfTheTargetTraceEverything) {
  Var x("x");
  Buffer<float> im(4, "im");
  im.fill(1.5f);
  Func f("f"), g("g");
  f(x) = im(x);
  g(x) = f(x) + im(x);
  f.store_root().compute_at(g, x);
  const Target target = get_jit_target_from_environment()
                            .with_feature(Target::TraceLoads)
                            .with_feature(Target::TraceStores)
                            .with_feature(Target::TraceRealizations);
  const std::vector<std::string> expected = {
      "Begin pipeline g.0()",
      "Tag f.0() tag = \"func_type_and_dim: 1 2 32 1 1 0 2\"",
      "Tag g.0() tag = \"func_type_and_dim: 1 2 32 1 1 0 2\"",
      "Begin realization g.0(0, 2)",
      "Begin realization f.0(0, 2)",
      "Produce g.0(0, 2)",
      "Produce f.0(0, 1)",
      "Load im.0(0) = 1.500000",
      "Store f.0(0) = 1.500000",
      "End produce f.0(0, 1)",
      "Consume f.0(0, 1)",
      "Load f.0(0) = 1.500000",
      "Load im.0(0) = 1.500000",
      "Store g.0(0) = 3.000000",
      "End consume f.0(0, 1)",
      "Produce f.0(1, 1)",
      "Load im.0(1) = 1.500000",
      "Store f.0(1) = 1.500000",
      "End produce f.0(1, 1)",
      "Consume f.0(1, 1)",
      "Load f.0(1) = 1.500000",
      "Load im.0(1) = 1.500000",
      "Store g.0(1) = 3.000000",
      "End consume f.0(1, 1)",
      "End produce g.0(0, 2)",
      "End realization f.0(0, 2)",
      "End realization g.0(0, 2)",
      "End pipeline g.0()"};
  EXPECT_EQ(trace_of(g, {2}, target), expected);
}

TEST(Tracing, ThePipelineAlone) {
  Var x("x");
  Func f("f");
  f(x) = x;
  const Target target = get_jit_target_from_environment().with_feature(Target::TracePipeline);
  EXPECT_EQ(trace_of(f, {2}, target),
            (std::vector<std::string>{"Begin pipeline f.0()", "End pipeline f.0()"}));
}

TEST(Tracing, WithoutTracingThereAreNoEvents) {
  Var x("x");
  Func f("f");
  f(x) = x;
  EXPECT_TRUE(trace_of(f, {2}).empty());
}

// ---- a handler ----

struct Collector : JITUserContext {
  struct Event {
    int32_t id, parent;
    int kind;
    std::string func;
  };
  std::mutex mutex;
  std::vector<Event> events;
};

int32_t collect(JITUserContext* context, const halide_trace_event_t* e) {
  auto& collector = *static_cast<Collector*>(context);
  const std::lock_guard lock(collector.mutex);
  const auto id = static_cast<int32_t>(collector.events.size() + 1);
  collector.events.push_back({id, e->parent_id, e->event, e->func});
  if (!e->value) EXPECT_EQ(e->type, halide_type_t(halide_type_handle, 0, 0)) << e->func;
  return id;
}

TEST(Tracing, ParentsFormTheHierarchyInParallelLoopsToo) {
  Var x("x"), y("y");
  Func f("f"), g("g");
  f(x, y) = x + y;
  g(x, y) = f(x, y) + f(x, y + 1);
  f.compute_at(g, y).trace_stores().trace_loads().trace_realizations();
  g.parallel(y).trace_realizations();
  Collector collector;
  collector.handlers.custom_trace = collect;
  g.realize(&collector, {4, 16});
  std::map<int32_t, Collector::Event> by_id;
  for (const auto& event : collector.events) by_id[event.id] = event;
  int stores = 0, loads = 0;
  for (const auto& event : collector.events) {
    if (event.kind == halide_trace_store || event.kind == halide_trace_load) {
      const bool is_store = event.kind == halide_trace_store;
      (is_store ? stores : loads)++;
      EXPECT_EQ(by_id.at(event.parent).kind,
                is_store ? halide_trace_produce : halide_trace_consume);
      EXPECT_EQ(by_id.at(event.parent).func, event.func);
    } else if (event.kind == halide_trace_begin_realization) {
      EXPECT_EQ(by_id.at(event.parent).kind, halide_trace_begin_pipeline);
    }
  }
  EXPECT_EQ(stores, 4 * 2 * 16);
  EXPECT_EQ(loads, 4 * 2 * 16);
}

}  // namespace
}  // namespace retrograde
