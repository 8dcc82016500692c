// opt -- runs one pass of the compiler on IR text: the smallest way to look at a pass, or to report
// what it does wrong.
//
//   opt --pass=vectorize_loops program.ir      reads a file; "-" or nothing: standard input
//   opt --list                                 names the passes
//   opt --pass=simplify --expr                 the text is one expression
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <string>

#include "diagnostics/error.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "lower/pass_table.h"
#include "simplify/simplify.h"

namespace {

using namespace retrograde;

struct Options {
  std::string pass;
  std::string file = "-";
  bool lists = false, is_expr = false;
};

std::optional<Options> parse_options(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    std::string arg = argv[i];
    if (arg.rfind("--pass=", 0) == 0) {
      options.pass = arg.substr(std::strlen("--pass="));
    } else if (arg == "--list") {
      options.lists = true;
    } else if (arg == "--expr") {
      options.is_expr = true;
    } else if (arg == "-" || arg[0] != '-') {
      options.file = arg;
    } else {
      return std::nullopt;
    }
  }
  if (options.pass.empty() && !options.lists) return std::nullopt;
  return options;
}

std::string read_all(const std::string& file) {
  if (file == "-") return {std::istreambuf_iterator<char>(std::cin), {}};
  std::ifstream in(file);
  if (!in) user_error(text("read ", quoted(file)), "the file must exist and be readable");
  return {std::istreambuf_iterator<char>(in), {}};
}

void run(const Options& options) {
  if (options.lists) {
    for (const ir::StatementPass& pass : ir::statement_passes()) std::cout << pass.name << "\n";
    return;
  }
  const ir::StatementPass* pass = ir::find_statement_pass(options.pass);
  if (!pass) {
    user_error(text("run the pass ", quoted(options.pass)),
               "a pass must be one of those that --list names");
  }
  std::string source = read_all(options.file);
  if (options.is_expr) {
    if (options.pass != "simplify")
      user_error("read one expression", "only the pass \"simplify\" takes one");
    std::cout << ir::simplify(ir::parse_expr(source)) << "\n";
  } else {
    std::cout << pass->run(ir::parse_stmt(source));
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::optional<Options> options = parse_options(argc, argv);
  if (!options) {
    std::cerr << "usage: opt --pass=NAME [--expr] [FILE]\n       opt --list\n";
    return 2;
  }
  try {
    run(*options);
    return 0;
  } catch (const std::exception& e) {
    std::cerr << "opt: " << e.what() << "\n";
    return 1;
  }
}
