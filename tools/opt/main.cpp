// opt -- runs the compiler's passes one by one: to examine a pass, to time it, or to reproduce a bug.
//
//   opt --pass=vectorize_loops program.ir           on IR text; "-" or nothing: standard input
//   opt --pass=unroll_loops,simplify program.ir     several passes in this order
//   opt --print program.ir                          prints the text as the compiler writes it
//   opt --pass=simplify --expr                      the text is one expression
//   opt --graph [--pass=schedule_unscheduled] program.graph
//                                                   the text is an algorithm (graph/graph.h), which
//                                                   is checked; --stop-after=PASS also lowers it up to PASS
//   opt --graph --pass=fork_async program.lowered   runs one pass of lowering on an algorithm with a statement
//                                                   (program_text.h)
//   opt --graph --log=FILE program.graph            applies a schedule (graph/directives/schedule_log.h) before
//                                                   the passes run
//   opt --graph [--pass=schedule_unscheduled] --plan program.graph
//                                                   prints the schedule as a plan (autoschedule/plan/plan.h)
//   opt --graph [--pass=schedule_unscheduled] --cost program.graph
//                                                   prints what the schedule costs (autoschedule/cost/cost.h)
//   opt --graph --move=tile [--func=f] program.graph
//                                                   prints the plans that a move gives (move_text.h)
//   opt --time-passes --dump-after=all ...          prints the time and the result of each pass
//   opt --time-passes --dump-after=PASS,... -- PROGRAM ARGS...
//                                                   for everything that a program compiles while it runs
//   opt --list, opt --list-pipeline                 lists the passes for IR text; those of the
//                                                   compiler, in its order
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "autoschedule/cost/cost.h"
#include "autoschedule/machine/kept_machine.h"
#include "autoschedule/plan/plan.h"
#include "diagnostics/error.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"
#include "graph/graph.h"
#include "graph_passes.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "lower/lower.h"
#include "lower/statement_passes.h"
#include "move_text.h"
#include "program_text.h"
#include "simplify/simplify.h"

namespace {

using namespace retrograde;

struct Options {
  std::vector<std::string> passes, dumped;
  std::string file = "-", stop_after, log, move, func;
  std::vector<char*> program;  // the words after "--", null-terminated
  bool lists = false, lists_pipeline = false, is_expr = false, is_graph = false, times = false,
       prints = false, plans = false, prices = false;
  bool dumps(const std::string& pass) const {
    return std::find(dumped.begin(), dumped.end(), pass) != dumped.end() ||
           std::find(dumped.begin(), dumped.end(), "all") != dumped.end();
  }
};

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

// The text after "--name=".
std::optional<std::string> value_of(const std::string& arg, const std::string& name) {
  const std::string begin = "--" + name + "=";
  if (arg.rfind(begin, 0) != 0) return std::nullopt;
  return arg.substr(begin.size());
}

bool read_option(const std::string& arg, Options& options) {
  if (const auto passes = value_of(arg, "pass")) {
    options.passes = split(*passes, ',');
  } else if (const auto log = value_of(arg, "log")) {
    options.log = *log;
  } else if (const auto move = value_of(arg, "move")) {
    options.move = *move;
  } else if (const auto func = value_of(arg, "func")) {
    options.func = *func;
  } else if (const auto dumped = value_of(arg, "dump-after")) {
    options.dumped = split(*dumped, ',');
  } else if (arg == "--print") {
    options.prints = true;
  } else if (arg == "--plan") {
    options.plans = true;
  } else if (arg == "--cost") {
    options.prices = true;
  } else if (arg == "--list") {
    options.lists = true;
  } else if (arg == "--list-pipeline") {
    options.lists_pipeline = true;
  } else if (arg == "--expr") {
    options.is_expr = true;
  } else if (arg == "--graph") {
    options.is_graph = true;
  } else if (const auto last = value_of(arg, "stop-after")) {
    options.stop_after = *last;
  } else if (arg == "--time-passes") {
    options.times = true;
  } else if (arg == "-" || arg[0] != '-') {
    options.file = arg;
  } else {
    return false;
  }
  return true;
}

std::optional<Options> parse_options(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--") == 0) {
      options.program.assign(argv + i + 1, argv + argc);
      break;
    }
    if (!read_option(argv[i], options)) return std::nullopt;
  }
  const bool has_task = !options.passes.empty() || options.lists || options.lists_pipeline ||
                        options.prints || options.is_graph || !options.program.empty();
  if (!has_task) return std::nullopt;
  if (!options.program.empty()) options.program.push_back(nullptr);
  return options;
}

std::string read_all(const std::string& file) {
  if (file == "-") return {std::istreambuf_iterator<char>(std::cin), {}};
  std::ifstream in(file);
  if (!in) user_error(text("read ", quoted(file)), "the file must exist and be readable");
  return {std::istreambuf_iterator<char>(in), {}};
}

// ---- times ----

class TimeTable {
 public:
  void add(const std::string& pass, double milliseconds) {
    if (!rows_.count(pass)) order_.push_back(pass);
    rows_[pass].first++;
    rows_[pass].second += milliseconds;
    total_ += milliseconds;
  }
  void print(std::ostream& out) const {
    out << std::left << std::setw(28) << "pass" << std::right << std::setw(6) << "runs"
        << std::setw(12) << "ms" << std::setw(8) << "%"
        << "\n"
        << std::fixed;
    for (const std::string& pass : order_) print_row(out, pass, rows_.at(pass));
    print_row(out, "total", {0, total_});
  }

 private:
  std::vector<std::string> order_;
  std::map<std::string, std::pair<int, double>> rows_;
  double total_ = 0;

  void print_row(std::ostream& out, const std::string& pass, std::pair<int, double> row) const {
    out << std::left << std::setw(28) << pass << std::right << std::setw(6)
        << (row.first ? std::to_string(row.first) : "") << std::setw(12) << std::setprecision(3)
        << row.second << std::setw(8) << std::setprecision(1)
        << (total_ > 0 ? 100 * row.second / total_ : 0.0) << "\n";
  }
};

// ---- IR text ----

const lower::StatementPass& find_pass(const std::string& name) {
  const lower::StatementPass* pass = lower::find_statement_pass(name);
  if (pass) return *pass;
  user_error(text("run the pass ", quoted(name)), "a pass must be one of those that --list names");
}

void run_expr(const Options& options) {
  if (options.passes != std::vector<std::string>{"simplify"})
    user_error("read one expression", "only the pass \"simplify\" takes one");
  std::cout << simplification::simplify(ir::parse_expr(read_all(options.file))) << "\n";
}

std::string cost_text(const planning::Plan& plan, const Target& target) {
  const planning::AccessGraph accesses(plan.program->outputs);
  const planning::SizeModel sizes(accesses, {planning::unknown_extent});
  const planning::Machine machine = planning::machine_for(target);
  return to_text(planning::CostModel(accesses, sizes, machine).price(plan), plan);
}

void run_graph(const Options& options) {
  opt::MoveText move = opt::split_move(read_all(options.file));
  if (!options.func.empty()) move.func = options.func;
  opt::ProgramText program = opt::parse_program(move.graph, get_host_target());
  if (!options.log.empty()) {
    const ScheduleLog log = ScheduleLog::parse(read_all(options.log));
    program.graph = graph::graph_of(graph::with_log(log, program.graph.outputs));
    graph::validate(program.graph, "with_log");
  }
  if (!options.stop_after.empty()) {
    const lower::LowerOptions lowering{program.target, true, {}, options.stop_after};
    const auto args = lower::infer_arguments(program.graph.outputs);
    std::cout << lower::lower("graph", program.graph.outputs, args, lowering).body;
    return;
  }
  std::string result = graph::to_text(program.graph);
  for (const std::string& pass : options.passes) {
    result = opt::text_after(pass, program);
    if (&pass != &options.passes.back() || options.plans || options.prices || !options.move.empty())
      program = opt::parse_program(result, program.target);
  }
  if (!options.move.empty()) {
    result = opt::plans_after(options.move, move, program.graph.outputs);
  } else if (options.plans || options.prices) {
    const auto plan = planning::import_plan(graph::apply_wrappers(program.graph.outputs));
    result = options.plans ? to_text(plan) : "";
    if (options.prices) result += cost_text(plan, program.target);
  }
  std::cout << result;
}

void run_passes(const Options& options) {
  for (const std::string& name : options.passes) find_pass(name);
  Stmt stmt = ir::parse_stmt(read_all(options.file));
  TimeTable times;
  for (const std::string& name : options.passes) {
    const auto start = std::chrono::steady_clock::now();
    stmt = find_pass(name).run(stmt);
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    times.add(name, taken.count());
    if (options.dumps(name)) std::cout << "after " << name << ":\n" << stmt << "\n";
  }
  if (options.dumped.empty()) std::cout << stmt;
  if (options.times) times.print(std::cerr);
}

// ---- a program ----

// A temporary file that is deleted on destruction.
class LogFile {
 public:
  LogFile() {
    const int descriptor = mkstemp(name_);
    if (descriptor < 0) user_error("make a file in /tmp", "opt keeps the compiler's log there");
    close(descriptor);
  }
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;
  ~LogFile() { unlink(name_); }
  const char* name() const { return name_; }

 private:
  char name_[32] = "/tmp/retrograde_opt_XXXXXX";
};

int run_and_wait(const Options& options, const char* log) {
  const pid_t child = fork();
  if (child == 0) {
    std::string dumped;
    for (const std::string& pass : options.dumped) dumped += (dumped.empty() ? "" : ",") + pass;
    setenv("RETROGRADE_PASS_LOG", log, 1);
    setenv("RETROGRADE_DUMP_AFTER", dumped.c_str(), 1);
    execvp(options.program[0], options.program.data());
    std::perror(options.program[0]);
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child)
    user_error(text("run ", quoted(options.program[0])), "the system must start it");
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

// Lines "pass NAME MS ms of PIPELINE" are times; all other lines are dumps.
void show_log(const Options& options, const char* log) {
  std::ifstream in(log);
  TimeTable times;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string pass, name, unit;
    double milliseconds = 0;
    const bool is_time = static_cast<bool>(words >> pass >> name >> milliseconds >> unit) &&
                         pass == "pass" && unit == "ms";
    if (is_time) {
      times.add(name, milliseconds);
    } else {
      std::cout << line << "\n";
    }
  }
  if (options.times) times.print(std::cerr);
}

int run_program(const Options& options) {
  const LogFile log;
  const int status = run_and_wait(options, log.name());
  show_log(options, log.name());
  return status;
}

int run(const Options& options) {
  if (!options.program.empty()) return run_program(options);
  if (options.lists) {
    for (const opt::GraphPass& pass : opt::graph_passes()) std::cout << pass.name << " (--graph)\n";
    for (const lower::StatementPass& pass : lower::statement_passes())
      std::cout << pass.name << "\n";
  } else if (options.lists_pipeline) {
    for (const std::string& name : lower::pass_names()) std::cout << name << "\n";
  } else if (options.is_graph) {
    run_graph(options);
  } else {
    options.is_expr ? run_expr(options) : run_passes(options);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::optional<Options> options = parse_options(argc, argv);
  if (!options) {
    std::cerr << "usage: opt --pass=NAME,... [--expr] [--time-passes] [--dump-after=NAME,...|all] "
                 "[FILE]\n"
                 "       opt --print [FILE]\n"
                 "       opt --graph [--log=FILE] [--pass=NAME,... | --stop-after=NAME] [--plan] "
                 "[--cost] [FILE]\n"
                 "       opt --graph [--pass=NAME,...] --move=NAME [--func=NAME] [FILE]\n"
                 "       opt [--time-passes] [--dump-after=NAME,...|all] -- PROGRAM ARGS...\n"
                 "       opt --list | --list-pipeline\n";
    return 2;
  }
  try {
    return run(*options);
  } catch (const std::exception& e) {
    std::cerr << "opt: " << e.what() << "\n";
    return 1;
  }
}
