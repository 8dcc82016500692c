// Generates docs/scheduling.md and compares it with the file: each directive with example code and
// the loops before and after it, as the compiler prints them. The page therefore agrees with the
// compiler. RETROGRADE_UPDATE_GOLDEN=1 rewrites the page; read the difference before you commit it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>
#include <sstream>

#include "frontend/language/func.h"
#include "ir/print.h"
#include "lower/lower.h"
#include "retrograde/retrograde.h"

namespace retrograde {
namespace {

// What a section shows: the loops of Func::print_loop_nest (null), or the statement after this pass.
using View = const char*;
constexpr View Loops = nullptr, Storage = "simplify_storage", Branches = "fork_async",
               Lookups = "memoize", Cut = "partition_loops";

struct Directive {
  const char* name;
  const char* meaning;
  View view;
  const char *algorithm, *schedule;  // as C++
  std::function<void(std::vector<Func>&, bool is_scheduled)> build;
};

#define PLAIN(...) __VA_ARGS__
#define AS_TEXT(...) #__VA_ARGS__
// The algorithm defines the Funcs; `f` is the output. Both code arguments stand in parentheses.
#define DIRECTIVE(name, meaning, view, algorithm, schedule)                           \
  {                                                                                   \
    name, meaning, view, AS_TEXT algorithm, AS_TEXT schedule,                         \
        [](std::vector<Func>&outputs, bool is_scheduled) {                            \
          Var x("x"), y("y"), xo("xo"), yo("yo"), xi("xi"), yi("yi"), t("t"), u("u"); \
          PLAIN algorithm;                                                            \
          if (is_scheduled) {                                                         \
            PLAIN schedule;                                                           \
          }                                                                           \
          outputs = {f};                                                              \
        }                                                                             \
  }

#define ONE_FUNC (Func f("f"); f(x, y) = x + y)
#define TWO_FUNCS (Func f("f"), g("g"); g(x, y) = 3 * x - y; f(x, y) = max(g(x, y), g(x, y + 2)))
#define SUM (Func f("f"), g("g"); RDom r(0, 64, "r"); g(x) = x * x; f() = 0; f() += g(r))

const std::vector<Directive>& loop_directives() {
  static const std::vector<Directive> directives = {
    DIRECTIVE("split",
              "Replaces a loop by two nested loops; the inner one has `factor` iterations. The\n"
              "tail strategy decides what happens if the factor does not divide the extent.",
              Loops, ONE_FUNC, (f.split(x, xo, xi, 8))),
    DIRECTIVE("fuse", "Replaces two nested loops by one loop over both.", Loops, ONE_FUNC,
              (f.fuse(x, y, t))),
    DIRECTIVE("rename", "Gives a loop another name.", Loops, ONE_FUNC, (f.rename(x, t))),
    DIRECTIVE("reorder",
              "Changes the nesting order of loops. Arguments are listed innermost first.", Loops,
              ONE_FUNC, (f.reorder(y, x))),
    DIRECTIVE("tile",
              "Splits two loops and reorders the four resulting ones, so that the points are\n"
              "visited tile by tile.",
              Loops, ONE_FUNC, (f.tile(x, y, xo, yo, xi, yi, 8, 4))),
    DIRECTIVE("parallel",
              "Distributes the iterations of a loop over threads. With a task size, the loop is\n"
              "split first and each task runs that many iterations.",
              Loops, ONE_FUNC, (f.parallel(y, 4))),
    DIRECTIVE("vectorize",
              "Turns the iterations of a loop into vector lanes. The extent must be a constant;\n"
              "with a factor, the loop is split first.",
              Loops, ONE_FUNC, (f.vectorize(x, 8))),
    DIRECTIVE("unroll",
              "Replaces a loop by one copy of its body per iteration. The extent must be a\n"
              "constant or have a constant upper bound (its own, or one that an enclosing\n"
              "condition implies). With an upper bound only, each copy is guarded by a test\n"
              "that the loop has this iteration.",
              Loops, ONE_FUNC, (f.unroll(x, 2))),
    DIRECTIVE("partition, never_partition, always_partition",
              "Controls loop partitioning: the compiler splits a loop where a condition changes\n"
              "that holds in most iterations, so that the steady state runs without the test.\n"
              "`Auto` does so only where it saves work, `Never` keeps one loop, and `Always`\n"
              "splits wherever a test can be removed.",
              Cut, (Func f("f"); f(x) = select(likely(x > 3), x * x * x, x / 3)),
              (f.never_partition(x))),
    DIRECTIVE("specialize",
              "Adds a second schedule for a stage. It applies if a condition over parameters\n"
              "holds.",
              Loops, (Func f("f"); Param<bool> wide("wide"); f(x, y) = x + y),
              (f.specialize(wide).vectorize(x, 8))),
    DIRECTIVE("specialize_fail",
              "Makes the call fail with a message if no condition of the stage's\n"
              "specializations holds.",
              Loops, (Func f("f"); Param<bool> wide("wide"); f(x, y) = x + y),
              (f.specialize(wide).vectorize(x, 8); f.specialize_fail("f wants wide images"))),
    DIRECTIVE("atomic",
              "Makes each update of an element indivisible, so that a reduction may run in\n"
              "parallel or in vector lanes. When vectorized, each lane holds a partial result:\n"
              "the serial loops around the lanes carry a vector, which is combined after the\n"
              "loops. A sum of floats is therefore rounded in another order than the declared\n"
              "one. This order depends on the schedule alone, so every run gives the same bits,\n"
              "unless the reduction is parallel too.",
              Loops, SUM, (f.update().atomic().vectorize(r, 8))),
    DIRECTIVE("rfactor",
              "Splits an associative update into two reductions. The first one computes a\n"
              "partial result for each value of a new pure variable, in a Func of its own; the\n"
              "second one combines the partial results.",
              Loops,
              (Func f("f"), g("g"); RDom r(0, 64, 0, 64, "r"); g(x, y) = 3 * x - y; f() = 0;
               f() += g(r.x, r.y)),
              (f.update().rfactor(r.y, u).compute_root().update().parallel(u))),
  };
  return directives;
}

const std::vector<Directive>& place_directives() {
  static const std::vector<Directive> directives = {
    DIRECTIVE("compute_root",
              "Computes the whole required region of a Func before any of its consumers runs.",
              Loops, TWO_FUNCS, (g.compute_root())),
    DIRECTIVE("compute_at",
              "Computes a Func inside a loop of its consumer: in each iteration, the region\n"
              "that the iteration requires.",
              Loops, TWO_FUNCS, (g.compute_at(f, y))),
    DIRECTIVE("store_root, store_at",
              "Allocates storage outside the loop at which the Func is computed. Each iteration\n"
              "then computes only the values that earlier iterations did not (sliding window),\n"
              "and the storage is folded to the part that is still needed.",
              Loops, TWO_FUNCS, (g.store_root().compute_at(f, y))),
    DIRECTIVE("compute_with",
              "Fuses the loops of a stage with those of another stage, from the outermost loop\n"
              "down to the named one. If the ranges of the two stages differ, the fused loops\n"
              "cover both ranges, and each stage runs within its own range only. A reduction loop\n"
              "of the stage may run with a pure loop of the other that has its name.",
              Loops,
              (Func f("f"), g("g"), h("h"); g(x, y) = 3 * x - y; h(x, y) = max(x, y);
               g.compute_root(); h.compute_root(); f(x, y) = select(x < y, g(x, y), h(x, y))),
              (h.compute_with(g, y))),
    DIRECTIVE("async",
              "Computes a Func on a separate thread. The rest of the pipeline continues until\n"
              "it needs the values.",
              Branches, (Func f("f"), g("g"); g(x) = x * x; g.compute_root(); f(x) = g(x)),
              (g.async())),
    DIRECTIVE("memoize",
              "Keeps the values of a Func in a cache between calls. The key consists of all\n"
              "parameters that the values depend on.",
              Lookups, (Func f("f"), g("g"); g(x) = x * x; g.compute_root(); f(x) = g(x)),
              (g.memoize())),
    DIRECTIVE("in",
              "Inserts a wrapper between a Func and its consumers. The wrapper is a Func with a\n"
              "schedule of its own.",
              Loops, TWO_FUNCS, (g.compute_root(); g.in(f).compute_at(f, y))),
    DIRECTIVE("clone_in",
              "Gives some consumers of a Func their own copy of it, with a schedule of its own.",
              Loops, TWO_FUNCS, (g.clone_in(f).compute_root())),
    DIRECTIVE("copy_input",
              "Inserts a Func that copies an input image for one consumer, so that the copy can\n"
              "be scheduled.",
              Loops,
              (Func f("f"); ImageParam image(Int(32), 2, "image");
               f(x, y) = max(image(x, y), image(x, y + 2))),
              (f.copy_input(image).compute_at(f, y))),
    DIRECTIVE("bound",
              "Promises which region of a dimension is computed. A call that requires more\n"
              "fails.",
              Loops, ONE_FUNC, (f.bound(x, 0, 64))),
    DIRECTIVE("align_extent",
              "Grows the computed region until its extent is a multiple of a number.", Loops,
              TWO_FUNCS, (g.compute_at(f, y).align_extent(x, 8).vectorize(x, 8))),
    DIRECTIVE("align_bounds",
              "Grows the computed region until both its min and its extent are multiples of a\n"
              "number.",
              Loops, TWO_FUNCS, (g.compute_at(f, y).align_bounds(x, 8).vectorize(x, 8))),
  };
  return directives;
}

const std::vector<Directive>& storage_directives() {
  static const std::vector<Directive> directives = {
    DIRECTIVE("reorder_storage",
              "Changes the order of the dimensions in memory. Arguments are listed innermost\n"
              "first.",
              Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_root(); f(x, y) = g(x, y)),
              (g.reorder_storage(y, x))),
    DIRECTIVE("align_storage",
              "Rounds the allocated extent of a dimension up to a multiple of a number.", Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_root(); f(x, y) = g(x, y)),
              (g.align_storage(x, 16))),
    DIRECTIVE("bound_storage",
              "Promises an upper bound of the allocated extent of a dimension. A call that\n"
              "needs more fails.",
              Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_at(f, y); f(x, y) = g(x, y)),
              (g.bound_storage(x, 64))),
    DIRECTIVE("hoist_storage",
              "Moves an allocation to an outer loop: memory is allocated once, in the largest\n"
              "size that any iteration needs. The region computed in each iteration does not\n"
              "change.",
              Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; f(x, y) = g(x - 1, y) ^ g(x + 2, y);
               f.split(x, xo, xi, 8); g.compute_at(f, xo)),
              (g.hoist_storage_root())),
    DIRECTIVE("ring_buffer",
              "Gives hoisted storage several copies, which the iterations use in turn. An\n"
              "`async` Func is computed that many iterations ahead of its consumers.",
              Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; f(x, y) = g(x, y) ^ g(x + 2, y);
               g.compute_at(f, y).hoist_storage_root().bound_extent(x, 64)),
              (g.ring_buffer(2))),
    DIRECTIVE("fold_storage",
              "Stores a dimension modulo a number, so that later coordinates reuse the memory\n"
              "of earlier ones.",
              Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.store_root().compute_at(f, y);
               f(x, y) = max(g(x, y), g(x, y + 2))),
              (g.fold_storage(y, 8))),
    DIRECTIVE("store_in", "Chooses the kind of memory.", Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_at(f, y).bound_extent(x, 64);
               f(x, y) = g(x, y)),
              (g.store_in(MemoryType::Stack))),
    DIRECTIVE("prefetch", "Fetches the data that a later iteration reads into the cache.", Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_root(); f(x, y) = g(x, y)),
              (f.prefetch(g, y, y, 2))),
    DIRECTIVE("trace_stores, trace_loads, trace_realizations",
              "Reports every store, every load, or the beginning and end of every realization\n"
              "to a function that the caller may set.",
              Storage, (Func f("f"), g("g"); g(x) = x * x; g.compute_root(); f(x) = g(x)),
              (g.trace_stores())),
  };
  return directives;
}

std::string replaced(const std::string& text, const char* pattern, const char* by) {
  return std::regex_replace(text, std::regex(pattern), by);
}

// Puts the statements of "a; b" on lines of their own, without the blanks of stringification.
std::string as_code(const char* text) {
  return replaced(replaced(text, ";\\s*$", ""), ";\\s*", ";\n") + ";\n";
}

std::string statement_text(const std::vector<Func>& outputs, View view) {
  std::vector<graph::FuncPtr> funcs;
  for (const Func& f : outputs) funcs.push_back(f.function());
  std::string result;
  lower::LowerOptions options;
  options.stop_after = view;
  // Optimizations of loops without directives are off, so that only the directive changes loops.
  options.target = Target("x86-64-linux-disable_llvm_loop_opt");
  ir::LoweredFunction lowered = lower::lower("f", funcs, lower::infer_arguments(funcs), options);
  return ir::print(lowered.body);
}

// Whether this line opens an allocation or a computation.
bool is_beginning(const std::string& line, size_t first) {
  for (const char* word : {"allocate", "realize", "produce"}) {
    if (line.find(word) == first) return true;
  }
  return false;
}

// The first allocation or computation with its body. The code around it checks arguments and is the
// same for every pipeline.
std::string first_computation(const std::string& text) {
  std::istringstream lines(text);
  std::string result, line;
  size_t indent = std::string::npos;
  while (std::getline(lines, line)) {
    const size_t first = line.find_first_not_of(' ');
    if (indent == std::string::npos && is_beginning(line, first)) indent = first;
    if (indent == std::string::npos) continue;
    if (first < indent) break;
    result += line.substr(indent) + "\n";
  }
  return result;
}

std::string view_of(const Directive& directive, bool is_scheduled) {
  std::vector<Func> outputs;
  directive.build(outputs, is_scheduled);
  const std::string text = directive.view == Loops
                               ? Pipeline(outputs).loop_nest()
                               : first_computation(statement_text(outputs, directive.view));
  // Removes the numbers of generated names, which count up within a process. A memoization key holds
  // the name letter by letter, and its hash.
  const std::string keys = replaced(text, "\\d+, (\\d+_u8, )+", "..., ");
  return replaced(replaced(keys, "(memoization_key), \\d+", "$1, ..."), "\\$\\d+", "");
}

std::string section(const Directive& d) {
  std::ostringstream out;
  out << "### " << d.name << "\n\n"
      << d.meaning << "\n\n```c++\n"
      << as_code(d.algorithm) << "// " << d.name << "\n"
      << as_code(d.schedule) << "```\n\n"
      << "Before:\n```text\n"
      << view_of(d, false) << "```\nAfter:\n```text\n"
      << view_of(d, true) << "```\n\n";
  return out.str();
}

std::string page() {
  std::string text =
      "# Scheduling\n"
      "\n"
      "A schedule decides when, where and in which order the values of a Func are computed and\n"
      "stored. It never changes the values themselves, except for the rounding of\n"
      "floating-point sums that `atomic` and `rfactor` reorder.\n"
      "\n"
      "This page shows each directive with an example: the code, and the program before and\n"
      "after the directive is applied. Most sections show loops as `Func::print_loop_nest`\n"
      "prints them; the others show lowered statements, which include storage. The rules and\n"
      "errors of each directive stand in the headers `frontend/schedule/loop_directives.h` and\n"
      "`frontend/language/func.h`. The test `test/golden/scheduling_page_test.cpp` generates\n"
      "the page and compares it with what the compiler does.\n"
      "\n"
      "## Default schedule\n"
      "\n"
      "- A Func with only a pure definition is inlined into its consumers, unless this would\n"
      "  explode code size. This is why `g` is absent from most \"before\" loops.\n"
      "- A Func with update definitions is computed in the innermost loop of its consumer.\n"
      "- A stage starts with one serial loop per variable. The reduction variables are\n"
      "  innermost, in their order; the pure variables follow, the first argument innermost\n"
      "  among them.\n"
      "- The compiler schedules gradients that have no directives, on a copy of the program\n"
      "  ([autoscheduler.md](autoscheduler.md)). `Pipeline::unscheduled()` turns this off.\n"
      "- `Pipeline::auto_schedule(target)` gives directives to the Funcs that have none. They\n"
      "  appear in the schedule log and, as C++, in the result's `schedule_source`.\n"
      "\n"
      "## Schedules as values\n"
      "\n"
      "`Pipeline::schedule_log()` returns all directives of a program in the order in which\n"
      "they were given. The log can be written as text (`to_text`) or C++ (`to_cpp`) and parsed\n"
      "from text (`parse`). `of` selects the directives of one Func, `first` the first n, and\n"
      "`without` leaves one out. `Pipeline::apply_schedule()` applies a log to the same program\n"
      "without a schedule.\n"
      "\n";
  const std::pair<const char*, const std::vector<Directive>*> chapters[] = {
      {"Loops of a stage", &loop_directives()},
      {"Compute level", &place_directives()},
      {"Storage", &storage_directives()}};
  for (const auto& [title, directives] : chapters) {
    text += std::string("## ") + title + "\n\n";
    for (const Directive& d : *directives) text += section(d);
  }
  return text;
}

TEST(SchedulingPage, ShowsWhatTheCompilerDoes) {
  const std::string file = RETROGRADE_TEST_DIR "/../docs/scheduling.md";
  const std::string text = page();
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) {
    std::ofstream(file) << text;
    return;
  }
  std::ifstream in(file);
  EXPECT_EQ(text, std::string(std::istreambuf_iterator<char>(in), {}));
}

}  // namespace
}  // namespace retrograde
