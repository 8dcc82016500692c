// Applies each log of golden/schedule_log/directives.in, which together have every directive, to
// one program. The .out file holds the log as text, its effect on the graph, and the log as C++.
// RETROGRADE_UPDATE_GOLDEN=1 writes the .out file instead, and statements.inc, which is compiled
// here and must produce the log that it was printed from.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "graph/directives/directive_text.h"
#include "graph/graph.h"
#include "support/errors.h"
#include "support/golden_files.h"
#include "support/same_numbers.h"
#include "testing/random_schedule.h"

namespace retrograde {
namespace {

const std::string folder = std::string(RETROGRADE_TEST_DIR) + "/golden/schedule_log/";

void expect_file(const std::string& name, const std::string& text) {
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(folder + name) << text;
  EXPECT_EQ(text, read_file(folder + name));
}

struct Program {
  ImageParam input{Float(32), 2, "input"};
  Param<int> n{"n"};
  Var x{"x"}, y{"y"};
  RDom r{0, 8, 0, 4, "r"};
  Func f{"f"}, g{"g"}, h{"h"}, out{"out"};
  Program() {
    f(x, y) = input(x, y) * cast<float>(n);
    g(x, y) = 0.0f;
    g(x, y) += f(x + r.x, y + r.y);
    h(x, y) = f(x, y) + 1.0f;
    out(x, y) = g(x, y) + f(x, y) + h(x, y);
  }
};

graph::Graph fresh_graph() {
  static const std::string text = graph::to_text(graph::graph_of({Program().out.function()}));
  return graph::parse_graph(same_numbers(text));
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::vector<ScheduleLog> logs() {
  std::vector<ScheduleLog> result;
  std::string part;
  for (const std::string& line : lines_of(read_file(folder + "directives.in") + "\n")) {
    if (!line.empty()) {
      part += line + "\n";
    } else if (!part.empty()) {
      result.push_back(ScheduleLog::parse(part));
      part.clear();
    }
  }
  return result;
}

// Lines that are new in the graph, below the entity that contains them.
std::string news(const std::string& before, const std::string& after) {
  std::multiset<std::string> known;
  for (const std::string& line : lines_of(before)) known.insert(line);
  std::string out, func;
  for (const std::string& line : lines_of(after)) {
    const auto found = known.find(line);
    const bool is_known = found != known.end();
    if (is_known) known.erase(found);
    if (line.rfind("func ", 0) == 0) func = line + "\n";
    if (is_known) continue;
    if (line + "\n" != func) out += func;
    func.clear();
    out += line + "\n";
  }
  return out;
}

TEST(ScheduleLogs, AreGraphsAndCpp) {
  std::string all;
  for (const ScheduleLog& log : logs()) {
    SCOPED_TRACE(log.to_text());
    SCOPED_TRACE(log.to_text());
    EXPECT_EQ(ScheduleLog::parse(log.to_text()), log);
    const graph::Graph graph = fresh_graph();
    const std::string before = graph::to_text(graph);
    graph::apply_log(log, graph.outputs);
    const graph::Graph scheduled = graph::graph_of(graph.outputs);
    graph::validate(scheduled, "apply_log");
    EXPECT_EQ(same_numbers(graph::schedule_log(graph.outputs).to_text()), log.to_text());
    all += "---- log\n" + log.to_text() + "---- graph\n" +
           same_numbers(news(before, graph::to_text(scheduled))) + "---- C++\n" + log.to_cpp() +
           "\n";
  }
  expect_file("directives.out", all);
}

TEST(ScheduleLogs, EveryDirectiveHasACase) {
  const std::vector<std::string> names = graph::directive_names();
  std::set<std::string> missing(names.begin(), names.end());
  for (const ScheduleLog& log : logs()) {
    for (const ScheduleLog::Entry& entry : log.entries) missing.erase(name_of(entry.directive));
  }
  for (const std::string& name : missing) ADD_FAILURE() << name;
}

// Applies all logs that can be applied one after another, as a program would.
TEST(ScheduleLogs, TheirCppGivesThem) {
  const char* const schedule = R"(f.clone_in(f_clone_in_h, h)
f_clone_in_h.compute_at(root)
f.in(f_in_g, g)
g.update(0).split(r.y, ro, ri, 2, GuardWithIf)
g.update(0).rfactor(g_intm, ro, u, r.x, v)
g_intm.compute_at(root)
g_intm.update(0).run(u, Parallel)
g_intm.update(0).run(ri, Unrolled)
g.compute_at(root)
g.split(x, x, lanes, 8, Auto)
g.run(lanes, Vectorized)
g.partition(x, Never)
f_in_g.compute_at(loop(g_intm, y, 1))
f_in_g.store_at(loop(g_intm, u, 1))
f_in_g.hoist_storage(root)
f_in_g.align_storage(x, n + 4)
f_in_g.reorder_storage(y, x)
f_in_g.fold_storage(x, 64, true)
out.split(x, xo, xi, 8, GuardWithIf)
out.fuse(xo, y, t)
out.rename(t, tile)
out.reorder(tile, xi)
out.run(tile, Parallel)
out.prefetch(f, xi, xi, 2, GuardWithIf)
out.prefetch(input, xi, xi, n, Clamp)
out.specialize(n == 64)
out.specialization(0).run(xi, Unrolled)
out.specialize(input.extent.0 > max(n, 8))
out.specialization(1).specialize(n < 3)
out.specialization(1).specialization(0).run(xi, Unrolled)
out.specialize_fail("no such size")
out.bound(x, 0, 64)
out.bound(y, _, 32)
out.align_bounds(x, 4, 0)
out.set_estimate(y, 0, 32)
h.compute_at(root)
h.memoize(n)
h.store_in(Heap)
h.bound_storage(x, 4096)
h.trace_loads()
h.trace_stores()
h.trace_realizations()
h.add_trace_tag("a \"tag\"")
h.debug_to_file("dump.npy")
f.compute_at(root)
f.compute_with(loop(f_clone_in_h, x, 0), y, AlignEnd, x, AlignStart)
f.async()
f.unscheduled()
f.memoize(_)
f.copy_input(input_in_f, input)
input_in_f.compute_at(root)
g.update(0).atomic(true)
g.update(0).allow_race_conditions()
)";
  const ScheduleLog log = ScheduleLog::parse(schedule);
  expect_file("statements.inc", log.to_cpp());
  Program program;
  {
    auto& [input, n, var_x, var_y, rdom, f, g, h, out] = program;
    static_cast<void>(var_x), static_cast<void>(var_y), static_cast<void>(rdom);
#include "golden/schedule_log/statements.inc"
  }
  const ScheduleLog given = Pipeline(program.out).schedule_log();
  EXPECT_EQ(same_numbers(given.to_text()), schedule);

  Program other;
  Pipeline pipeline(other.out);
  pipeline.apply_schedule(log);
  EXPECT_EQ(same_numbers(pipeline.schedule_log().to_text()), schedule);
  const auto text_of = [](const Func& out) {
    return same_numbers(graph::to_text(graph::graph_of({out.function()})));
  };
  EXPECT_EQ(text_of(other.out), text_of(program.out));
}

TEST(ScheduleLogs, AreCut) {
  const ScheduleLog log = ScheduleLog::parse(
      "f.compute_at(loop(g, y))\ng.run(x, Parallel)\ng.compute_at(root)\nout.prefetch(f, x, x, 1, "
      "Clamp)\n");
  EXPECT_EQ(log.first(1).to_text(), "f.compute_at(loop(g, y))\n");
  EXPECT_EQ(log.first(9), log);
  EXPECT_EQ(log.of("g").size(), 2u);
  EXPECT_EQ(log.without(3), log.first(3));
}

// Directives that depend on a removed directive are removed with it.
TEST(ScheduleLogs, LoseADirective) {
  const ScheduleLog log = ScheduleLog::parse(R"(f.in(w, g)
f.split(x, xo, xi, 8, Auto)
f.specialize(n == 1)
f.specialization(0).run(xi, Vectorized)
f.specialize(n == 2)
f.specialization(1).reorder(xo, xi, y)
f.fuse(xo, y, t)
f.run(t, Parallel)
w.compute_at(loop(f, xi))
h.compute_at(loop(f, xo))
)");
  EXPECT_EQ(log.entries[3].special, std::vector<int>{0});
  EXPECT_EQ(log.without(0).to_text(),
            log.of("f").without(0).to_text() + "h.compute_at(loop(f, xo))\n");
  EXPECT_EQ(log.without(1).to_text(), R"(f.in(w, g)
f.specialize(n == 1)
f.specialize(n == 2)
f.specialization(1).reorder(x, y)
f.fuse(x, y, t)
f.run(t, Parallel)
h.compute_at(loop(f, x))
)");
  EXPECT_EQ(log.of("f").without(2).to_text(), R"(f.in(w, g)
f.split(x, xo, xi, 8, Auto)
f.specialize(n == 2)
f.specialization(0).reorder(xo, xi, y)
f.fuse(xo, y, t)
f.run(t, Parallel)
)");
  EXPECT_EQ(log.of("f").without(6).of("f").size(), 7u);
  EXPECT_EQ(log.without(6).entries[6].func, "f");
  EXPECT_EQ(ScheduleLog{{log.without(6).entries[6]}}.to_text(), "f.run(xo, Parallel)\n");
}

TEST(ScheduleLogs, FollowLevelsThatAreSetLater) {
  Program p;
  LoopLevel level;
  p.f.compute_at(level);
  p.g.compute_root();
  level.set(LoopLevel(p.g, p.x, 1));
  EXPECT_EQ(same_numbers(Pipeline(p.out).schedule_log().to_text()),
            "f.compute_at(loop(g, x, 1))\ng.compute_at(root)\n");
}

// Directives without effect are not logged, and a stage without loops stays unscheduled.
TEST(ScheduleLogs, HoldWhatWasGiven) {
  Program p;
  Func scalar("scalar");
  scalar() = 1;
  scalar.never_partition_all();
  EXPECT_FALSE(scalar.get_schedule().is_given);
  EXPECT_EQ(Pipeline(scalar).schedule_log().size(), 0u);
  p.out.rename(p.x, p.x);
  EXPECT_TRUE(p.out.get_schedule().is_given);
  p.out.specialize(p.n > 3);
  p.out.specialize(p.n > 3);
  EXPECT_THROW(p.out.split(Var("z"), p.x, p.y, 8), CompileError);
  EXPECT_EQ(Pipeline(p.out).schedule_log().size(), 2u);
}

TEST(ScheduleLogs, SayWhatIsWrong) {
  expect_error({"every image that it names is one of the program", "\"other\""}, [] {
    Pipeline(Program().out).apply_schedule(ScheduleLog::parse("f.copy_input(copy, other)\n"));
  });
  expect_error({"line 2", "every line is a directive of a Func", "f.swap(x)"},
               [] { ScheduleLog::parse("f.compute_at(root)\nf.swap(x)"); });
  const auto refused = [](const std::string& log) {
    return error_of([&] { graph::apply_log(ScheduleLog::parse(log), fresh_graph().outputs); });
  };
  expect_mentions(refused("k.compute_at(root)"),
                  {"every Func that it names is one of the program", "none is called \"k\""});
  expect_mentions(refused("f.update(0).run(x, Parallel)"),
                  {"the target of a directive exists", "f.update(0)"});
  expect_mentions(refused("f.specialization(0).run(x, Parallel)"),
                  {"the target of a directive exists"});
  expect_mentions(refused("f.run(z, Parallel)"), {"\"z\" must be a loop of this stage"});
}

// Replays the random schedule of a program on a fresh copy.
TEST(ScheduleLogs, RandomSchedulesAreReplayed) {
  for (uint64_t seed = 1; seed <= 150; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    fuzz::Choices choices(seed);
    const auto program = fuzz::make_program(choices, fuzz::Style::pipelines());
    const std::vector<graph::FuncPtr> outputs = fuzz::outputs_of(program);
    const graph::Graph fresh = graph::parse_graph(graph::to_text(graph::graph_of(outputs)));
    fuzz::apply(fuzz::random_schedule(program, choices), program);
    const ScheduleLog log = graph::schedule_log(outputs);
    SCOPED_TRACE(log.to_text());
    EXPECT_EQ(ScheduleLog::parse(log.to_text()), log);
    ASSERT_NO_THROW(graph::apply_log(log, fresh.outputs)) << log.to_text();
    ASSERT_EQ(same_numbers(graph::to_text(graph::graph_of(fresh.outputs))),
              same_numbers(graph::to_text(graph::graph_of(outputs))))
        << log.to_text();
  }
}

}  // namespace
}  // namespace retrograde
