// The generator of random programs and its reducer: programs of every style are well formed and
// reproducible, every construct occurs, and a failing list of choices shrinks to a small program.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "graph/directives/directive.h"
#include "graph/graph.h"
#include "ir/visit.h"
#include "support/same_numbers.h"
#include "testing/programs/workloads.h"
#include "testing/random_schedule.h"

namespace retrograde::fuzz {
namespace {

using Counts = std::map<std::string, int>;

struct Drawn {
  RandomProgram program;
  ScheduleLog schedule;
  std::vector<uint32_t> taken;
};

Drawn draw(Choices choices, const Style& style = Style::pipelines()) {
  RandomProgram program = make_program(choices, style);
  ScheduleLog schedule = random_schedule(program, choices);
  return {program, schedule, choices.taken()};
}

// Counts over the Funcs that the outputs need: nodes of each kind, calls of each operator, Funcs of
// equal name, updates, predicates.
Counts counts_of(const RandomProgram& program) {
  Counts counts;
  for (const graph::FuncPtr& f : graph::topological_order(outputs_of(program))) {
    std::string name = graph::without_numbers(f->name);
    name.erase(std::find_if(name.begin(), name.end(), isdigit), name.end());
    ++counts["Func " + name];
    counts["update"] += f->stage_count() - 1;
    counts["Tuple"] += f->stage(0).values.size() > 1;
    for (int s = 0; s < f->stage_count(); ++s) counts["where"] += f->stage(s).predicate.defined();
    walk(*f, [&](const Expr& e) {
      const auto* call = e.as<ir::Call>();
      const bool is_op = call && call->call_type == ir::CallType::Operator;
      return ++counts[is_op ? ir::op_info(call->op).name : ir::kind_name(e.kind())], true;
    });
  }
  return counts;
}

// A construct that the generator silently stopped producing would be untested.
void expect_all(const Style& style, uint64_t programs, const std::vector<std::string>& wanted) {
  Counts seen;
  for (uint64_t seed = 0; seed < programs; ++seed) {
    Choices choices(seed);
    for (const auto& [what, n] : counts_of(make_program(choices, style))) seen[what] += n;
  }
  for (const std::string& what : wanted) EXPECT_GT(seen[what], 0) << what;
}

const std::vector<std::string> structures{"Func f",         "Func level",  "Func grid", "Func conv",
                                          "Func looked_up", "Func scan",   "Func wave", "Func best",
                                          "Func band",      "Func around", "Func loop"};

// The longest chain of Funcs that are each computed in loops of the next.
size_t longest_nesting(const ScheduleLog& schedule) {
  std::map<std::string, std::string> around;  // the Func in whose loops each is computed
  for (const ScheduleLog::Entry& entry : schedule.entries) {
    const auto* at = std::get_if<graph::ComputeAt>(&entry.directive);
    if (at && at->level.kind == graph::LoopLevel::Kind::At) around[entry.func] = at->level.func;
  }
  size_t longest = 0;
  for (const auto& [func, next] : around) {
    size_t length = 1;
    for (auto it = around.find(next); it != around.end(); it = around.find(it->second)) ++length;
    longest = std::max(longest, length);
  }
  return longest;
}

TEST(RandomPrograms, OfPipelinesCoverEveryOperator) {
  std::vector<std::string> wanted{"Add",
                                  "Sub",
                                  "Mul",
                                  "Div",
                                  "Mod",
                                  "Min",
                                  "Max",
                                  "EQ",
                                  "NE",
                                  "LT",
                                  "LE",
                                  "And",
                                  "Or",
                                  "Not",
                                  "Select",
                                  "Cast",
                                  "abs",
                                  "absd",
                                  "floor",
                                  "sqrt",
                                  "exp",
                                  "sin",
                                  "lerp",
                                  "bitwise_and",
                                  "bitwise_or",
                                  "bitwise_xor",
                                  "shift_left",
                                  "shift_right",
                                  "Tuple",
                                  "update",
                                  "where",
                                  "Func s",
                                  "Func copy",
                                  "Func sum",
                                  "Func product",
                                  "Func maximum",
                                  "Func minimum",
                                  "Func argmax",
                                  "Func repeat_edge",
                                  "Func constant_exterior",
                                  "Func repeat_image",
                                  "Func mirror_image",
                                  "Func mirror_interior"};
  wanted.insert(wanted.end(), structures.begin(), structures.end());
  expect_all(Style::pipelines(), 3000, wanted);
}

TEST(RandomPrograms, OfGradientsCoverEveryStructure) {
  std::vector<std::string> wanted{"Func c",   "Func ruled", "update",     "where",
                                  "fast_exp", "fast_pow",   "erf",        "pow",
                                  "undef",    "Func sum",   "Func argmin"};
  wanted.insert(wanted.end(), structures.begin(), structures.end());
  expect_all(Style::gradients(), 300, wanted);
  expect_all(Style::pieces(), 100,
             {"Func stencil", "Func window", "Func argmax", "Func argmin", "Func border",
              "Func half", "Func rows", "Func bins", "Func filter", "Func pointwise"});
}

// A kind draws only its own pieces.
TEST(RandomPrograms, OfWorkloadsCoverEveryForm) {
  const std::map<Workload, std::vector<std::string>> forms{
      {Workload::TimeLoops,
       {"Func state", "Func last", "Func change", "Func steps", "Func trace", "Func some",
        "Func swept", "Func relaxed", "Func filtered", "Func aligned", "Func powers"}},
      {Workload::Strides,
       {"Func conv", "Func dilated", "Func transposed", "Func phases", "Func frames", "Func signal",
        "Func down", "Func up", "Func coarse", "Func fine", "Func shuffled", "Func unshuffled",
        "Func parity", "Func interleaved", "Func swapped", "Func cyclic", "Func lifted"}},
      {Workload::IndexArrays,
       {"Func gathered", "Func rows", "Func pairs", "Func bag", "Func scattered", "Func stored",
        "Func message", "Func received", "Func product", "Func segments", "Func residual",
        "Func luma", "Func norm", "Func colours", "Func turned", "Func interpolated",
        "Func beyond"}}};
  for (const auto& [kind, wanted] : forms) {
    Counts seen;
    std::map<size_t, int> outputs;
    for (uint64_t seed = 0; seed < 300; ++seed) {
      Choices choices(seed);
      const RandomProgram program = make_workload(choices, kind);
      ASSERT_NO_THROW(graph::validate(graph::graph_of(outputs_of(program)), "make_workload"));
      ++outputs[program.outputs.size()];
      for (const auto& [what, n] : counts_of(program)) seen[what] += n;
    }
    for (const std::string& what : wanted) EXPECT_GT(seen[what], 0) << what;
    for (const size_t n : {1u, 2u, 3u}) EXPECT_GT(outputs[n], 60) << n << " outputs";
  }
}

TEST(RandomPrograms, CoverEveryDirectiveAndPlacement) {
  Counts seen;
  for (uint64_t seed = 0; seed < 400; ++seed) {
    for (const ScheduleLog::Entry& entry : draw(Choices(seed)).schedule.entries) {
      std::string name = name_of(entry.directive);
      if (const auto* run = std::get_if<graph::RunLoop>(&entry.directive))
        name += std::to_string(static_cast<int>(run->kind));
      if (const auto* at = std::get_if<graph::ComputeAt>(&entry.directive))
        name += std::to_string(static_cast<int>(at->level.kind));
      ++seen[name + (entry.special.empty() ? "" : " of a specialization")];
    }
  }
  // Directives that do not change the computation.
  const std::set<std::string> without{"unscheduled",   "set_estimate", "add_trace_tag",
                                      "debug_to_file", "run",          "compute_at"};
  std::vector<std::string> wanted = graph::directive_names();
  std::erase_if(wanted, [&](const std::string& name) { return without.count(name) != 0; });
  wanted.insert(wanted.end(), {"run0", "run1", "run2", "run3", "compute_at0", "compute_at1",
                               "compute_at2", "split of a specialization",
                               "run2 of a specialization", "reorder of a specialization"});
  for (const std::string& name : wanted) EXPECT_GT(seen[name], 5) << name;
}

// Everything that a definition names exists at that point: variables, Funcs, images, parameters.
TEST(RandomPrograms, AreValidGraphs) {
  for (const Style& style : {Style::pipelines(), Style::gradients(), Style::pieces()}) {
    for (uint64_t seed = 0; seed < 300; ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      Choices choices(seed);
      const RandomProgram program = make_program(choices, style);
      ASSERT_NO_THROW(graph::validate(graph::graph_of(outputs_of(program)), "make_program"));
    }
  }
}

TEST(RandomPrograms, AreReproducible) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    draw(Choices(seed));  // the first program of a process has no numbers in its names
    const Drawn a = draw(Choices(seed)), b = draw(Choices(a.taken));
    EXPECT_EQ(same_numbers(to_text(a.program, a.schedule)),
              same_numbers(to_text(b.program, b.schedule)));
  }
}

int stage_directives(const ScheduleLog& log) {
  return static_cast<int>(
      std::count_if(log.entries.begin(), log.entries.end(),
                    [](const ScheduleLog::Entry& e) { return is_of_stage(e.directive); }));
}

// Deeper ones take minutes: a chain of six scans of 5 x 6 pixels, each computed in the innermost
// loops of the next, ran for 197 seconds.
TEST(RandomPrograms, SchedulesNestFewFuncsInLoopsOfEachOther) {
  size_t longest = 0;
  for (uint64_t seed = 0; seed < 600; ++seed)
    longest = std::max(longest, longest_nesting(draw(Choices(seed)).schedule));
  EXPECT_EQ(longest, 3u);
}

TEST(RandomPrograms, ShrinkToThePropertyAndLittleElse) {
  const auto fails = [](const std::vector<uint32_t>& list) {
    const Drawn d = draw(Choices(list));
    return counts_of(d.program)["lerp"] >= 1 && stage_directives(d.schedule) >= 2;
  };
  std::vector<uint32_t> list;
  for (uint64_t seed = 0; seed < 400; ++seed) {
    const Drawn d = draw(Choices(seed));
    if ((list.empty() || d.taken.size() < list.size()) && fails(d.taken)) list = d.taken;
  }
  const Drawn small = draw(Choices(shrink_choices(list, fails, 15000)));
  const std::string text = to_text(small.program, small.schedule);
  EXPECT_TRUE(fails(small.taken));
  EXPECT_EQ(counts_of(small.program)["lerp"], 1) << text;
  EXPECT_EQ(counts_of(small.program)["update"], 0) << text;
  EXPECT_EQ(stage_directives(small.schedule), 2) << text;
  EXPECT_EQ(small.program.outputs.size(), 1u) << text;
}

}  // namespace
}  // namespace retrograde::fuzz
