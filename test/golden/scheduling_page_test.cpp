// Generates docs/scheduling.md: every directive with its code, and the compiler's loops before and
// after, so that the page agrees with the compiler. RETROGRADE_UPDATE_GOLDEN=1 writes the page;
// read the difference before you commit it.
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

// The text to show: the loops of Func::print_loop_nest, or the statement after this pass.
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
// The algorithm defines the Funcs and adds the outputs to `outputs`; both code arguments are in
// parentheses.
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
              "One loop becomes two. The tail strategy says what happens where the factor does not "
              "divide the extent.",
              Loops, ONE_FUNC, (f.split(x, xo, xi, 8))),
    DIRECTIVE("fuse", "Two loops become one.", Loops, ONE_FUNC, (f.fuse(x, y, t))),
    DIRECTIVE("rename", "A loop gets another name.", Loops, ONE_FUNC, (f.rename(x, t))),
    DIRECTIVE("reorder", "Loops change places; innermost first.", Loops, ONE_FUNC,
              (f.reorder(y, x))),
    DIRECTIVE("tile", "Two splits and a reorder.", Loops, ONE_FUNC,
              (f.tile(x, y, xo, yo, xi, yi, 8, 4))),
    DIRECTIVE("parallel", "Iterations are shared out to threads; with a task size, blocks of them.",
              Loops, ONE_FUNC, (f.parallel(y, 4))),
    DIRECTIVE("vectorize", "The iterations of a loop of constant extent become lanes.", Loops,
              ONE_FUNC, (f.vectorize(x, 8))),
    DIRECTIVE(
        "unroll",
        "The iterations of a loop of constant extent become a sequence; where only a constant "
        "above "
        "the extent is known, by itself or from a condition around, each runs if the loop has it.",
        Loops, ONE_FUNC, (f.unroll(x, 2))),
    DIRECTIVE("partition, never_partition, always_partition",
              "Whether a loop is cut where conditions change that hold in most of it. Auto cuts "
              "where that saves something.",
              Cut, (Func f("f"); f(x) = select(likely(x > 3), x * x * x, x / 3)),
              (f.never_partition(x))),
    DIRECTIVE("specialize", "Another schedule where a condition over parameters holds.", Loops,
              (Func f("f"); Param<bool> wide("wide"); f(x, y) = x + y),
              (f.specialize(wide).vectorize(x, 8))),
    DIRECTIVE("specialize_fail", "None of the conditions held: the call fails with a message.",
              Loops, (Func f("f"); Param<bool> wide("wide"); f(x, y) = x + y),
              (f.specialize(wide).vectorize(x, 8); f.specialize_fail("f wants wide images"))),
    DIRECTIVE("atomic",
              "Updates of one element are indivisible, so that a reduction may run in parallel or "
              "in lanes. Lanes are partial results: the serial loops around them carry a vector, "
              "which is combined after the loops. So a sum of floats is rounded in another order "
              "than the declared one; that order depends on the schedule alone, and every run "
              "gives the same bits unless the reduction is parallel, too.",
              Loops, SUM, (f.update().atomic().vectorize(r, 8))),
    DIRECTIVE("rfactor",
              "An associative update is cut in two; the first half reduces separately for each "
              "value of a new pure variable.",
              Loops,
              (Func f("f"), g("g"); RDom r(0, 64, 0, 64, "r"); g(x, y) = 3 * x - y; f() = 0;
               f() += g(r.x, r.y)),
              (f.update().rfactor(r.y, u).compute_root().update().parallel(u))),
  };
  return directives;
}

const std::vector<Directive>& place_directives() {
  static const std::vector<Directive> directives = {
    DIRECTIVE("compute_root", "All of it before anything that uses it.", Loops, TWO_FUNCS,
              (g.compute_root())),
    DIRECTIVE("compute_at", "What one iteration of a loop needs, inside that loop.", Loops,
              TWO_FUNCS, (g.compute_at(f, y))),
    DIRECTIVE("store_root, store_at",
              "Storage outside of the loop at which it is computed: each iteration computes only "
              "what is new, and storage is folded to what is alive.",
              Loops, TWO_FUNCS, (g.store_root().compute_at(f, y))),
    DIRECTIVE("compute_with",
              "A stage runs in the loops of another one, down to a loop. Where their ranges differ "
              "the loops run over both, and each stage where it would alone.",
              Loops,
              (Func f("f"), g("g"), h("h"); g(x, y) = 3 * x - y; h(x, y) = max(x, y);
               g.compute_root(); h.compute_root(); f(x, y) = select(x < y, g(x, y), h(x, y))),
              (h.compute_with(g, y))),
    DIRECTIVE("async",
              "A thread of its own computes it, while the rest goes on until it needs the values.",
              Branches, (Func f("f"), g("g"); g(x) = x * x; g.compute_root(); f(x) = g(x)),
              (g.async())),
    DIRECTIVE(
        "memoize", "Values are kept in a cache between calls, found by all that they depend on.",
        Lookups, (Func f("f"), g("g"); g(x) = x * x; g.compute_root(); f(x) = g(x)), (g.memoize())),
    DIRECTIVE("in", "A Func between another and its users, to be scheduled on its own.", Loops,
              TWO_FUNCS, (g.compute_root(); g.in(f).compute_at(f, y))),
    DIRECTIVE("clone_in", "A copy of a Func for some of its users.", Loops, TWO_FUNCS,
              (g.clone_in(f).compute_root())),
    DIRECTIVE("copy_input", "A copy of an image for the Func that reads it.", Loops,
              (Func f("f"); ImageParam image(Int(32), 2, "image");
               f(x, y) = max(image(x, y), image(x, y + 2))),
              (f.copy_input(image).compute_at(f, y))),
    DIRECTIVE("bound", "A promise of what is computed; a call that needs more fails.", Loops,
              ONE_FUNC, (f.bound(x, 0, 64))),
    DIRECTIVE("align_extent", "Computes more, so that the extent is a multiple.", Loops, TWO_FUNCS,
              (g.compute_at(f, y).align_extent(x, 8).vectorize(x, 8))),
    DIRECTIVE("align_bounds", "Computes more, so that the min and the extent are multiples.", Loops,
              TWO_FUNCS, (g.compute_at(f, y).align_bounds(x, 8).vectorize(x, 8))),
  };
  return directives;
}

const std::vector<Directive>& storage_directives() {
  static const std::vector<Directive> directives = {
    DIRECTIVE("reorder_storage", "Another dimension innermost in memory.", Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_root(); f(x, y) = g(x, y)),
              (g.reorder_storage(y, x))),
    DIRECTIVE("align_storage", "The extent in memory grows to a multiple.", Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_root(); f(x, y) = g(x, y)),
              (g.align_storage(x, 16))),
    DIRECTIVE("bound_storage",
              "A promise of how large an extent in memory ever is; a call that needs more fails.",
              Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_at(f, y); f(x, y) = g(x, y)),
              (g.bound_storage(x, 64))),
    DIRECTIVE(
        "hoist_storage",
        "Memory is allocated further out than the values live, once, as large as it ever gets.",
        Storage,
        (Func f("f"), g("g"); g(x, y) = 3 * x - y; f(x, y) = g(x - 1, y) ^ g(x + 2, y);
         f.split(x, xo, xi, 8); g.compute_at(f, xo)),
        (g.hoist_storage_root())),
    DIRECTIVE("ring_buffer",
              "Hoisted memory has several copies, which iterations use in turn. An async Func is "
              "computed that far ahead.",
              Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; f(x, y) = g(x, y) ^ g(x + 2, y);
               g.compute_at(f, y).hoist_storage_root().bound_extent(x, 64)),
              (g.ring_buffer(2))),
    DIRECTIVE("fold_storage", "Coordinates are taken modulo an extent.", Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.store_root().compute_at(f, y);
               f(x, y) = max(g(x, y), g(x, y + 2))),
              (g.fold_storage(y, 8))),
    DIRECTIVE("store_in", "The kind of memory.", Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_at(f, y).bound_extent(x, 64);
               f(x, y) = g(x, y)),
              (g.store_in(MemoryType::Stack))),
    DIRECTIVE("prefetch", "What a later iteration reads is fetched into the cache.", Storage,
              (Func f("f"), g("g"); g(x, y) = 3 * x - y; g.compute_root(); f(x, y) = g(x, y)),
              (f.prefetch(g, y, y, 2))),
    DIRECTIVE(
        "trace_stores, trace_loads, trace_realizations",
        "A function that the caller may set is told of every access, or of where values begin "
        "and end to live.",
        Storage, (Func f("f"), g("g"); g(x) = x * x; g.compute_root(); f(x) = g(x)),
        (g.trace_stores())),
  };
  return directives;
}

std::string replaced(const std::string& text, const char* pattern, const char* by) {
  return std::regex_replace(text, std::regex(pattern), by);
}

// Splits "a; b" into two lines, without the spaces that stringification leaves.
std::string as_code(const char* text) {
  return replaced(replaced(text, ";\\s*$", ""), ";\\s*", ";\n") + ";\n";
}

std::string statement_text(const std::vector<Func>& outputs, View view) {
  std::vector<graph::FuncPtr> funcs;
  for (const Func& f : outputs) funcs.push_back(f.function());
  std::string result;
  lower::LowerOptions options;
  options.stop_after = view;
  // Loops without directives stay as they are.
  options.target = Target("x86-64-linux-disable_llvm_loop_opt");
  ir::LoweredFunction lowered = lower::lower("f", funcs, lower::infer_arguments(funcs), options);
  return ir::print(lowered.body);
}

// Whether a line begins the part to show.
bool is_beginning(const std::string& line, size_t first) {
  for (const char* word : {"allocate", "realize", "produce"}) {
    if (line.find(word) == first) return true;
  }
  return false;
}

// The first allocation or computation with its body. The code around it checks arguments, which is
// the same for every pipeline.
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
  // The numbers in names depend on the process; a cache key contains the names letter by letter,
  // and their hash.
  const std::string keys = replaced(text, "\\d+, (\\d+_u8, )+", "..., ");
  return replaced(replaced(keys, "(_key:handle), \\d+", "$1, ..."), "\\$\\d+", "");
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
      "# Scheduling\n\n"
      "A schedule says in which order and where the points of a Func are computed; it never "
      "changes "
      "what is\ncomputed. This page shows every directive by the loops before and after it, as "
      "`print_loop_nest` gives\nthem, or by the statement with its storage. The headers "
      "`frontend/schedule/loop_directives.h` and `frontend/language/func.h` hold the\nrules. The "
      "page is written by "
      "`test/golden/scheduling_page_test.cpp`: what it shows is what the compiler\ndoes.\n\n"
      "## Schedules as values\n\n"
      "`Pipeline::schedule_log()` gives all directives of a program in the order in which they "
      "were "
      "given:\ntext (`to_text`, `parse`), C++ (`to_cpp`), what is said of one Func (`of`), its "
      "beginning (`first`), the\nsame without one directive (`without`). "
      "`Pipeline::apply_schedule()` gives a log to the same program\nwithout a schedule.\n\n"
      "`Pipeline::auto_schedule(target)` gives directives to the Funcs that have none; they stand "
      "in the log, and\nas C++ in the result's `schedule_source`. Compiling does so by itself for "
      "gradients, on a copy; after\n`Pipeline::unscheduled()` it does not.\n\n";
  const std::pair<const char*, const std::vector<Directive>*> chapters[] = {
      {"Loops of one stage", &loop_directives()},
      {"Where a Func is computed", &place_directives()},
      {"How it is stored", &storage_directives()}};
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
