// tune -- what the cost model knows of this machine.
//
//   tune --machine                   measures its figures, prints them, keeps them in the user's cache
//   tune --machine --output FILE     keeps them in a file instead, for RETROGRADE_MACHINE to name
//   tune --show                      prints those in use: measured ones, or constants
#include <cstring>
#include <fstream>
#include <iostream>
#include <string>

#include "diagnostics/error.h"
#include "tuning/calibrate.h"
#include "tuning/machine.h"

namespace {

using namespace retrograde;

int usage() {
  std::cerr << "usage: tune --machine [--output FILE] | --show\n";
  return 2;
}

void write(const std::string& path, const std::string& contents) {
  std::ofstream out(path);
  out << contents;
  if (out.flush()) return;
  user_error("write " + quoted(path), "the file must be writable", "writing it failed",
             "Name another one");
}

void measure(const std::string& output) {
  const tuning::Machine machine = tuning::calibrate(get_jit_target_from_environment());
  std::cout << machine.to_string();
  if (output.empty()) {
    std::cout << "kept in " << tuning::keep_machine(machine) << "\n";
  } else {
    write(output, machine.to_json());
    std::cout << "written to " << output << "\n";
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto is = [&](int i, const char* word) { return std::strcmp(argv[i], word) == 0; };
  const bool to_file = argc == 4 && is(1, "--machine") && is(2, "--output");
  try {
    if (argc == 2 && is(1, "--show")) {
      std::cout << tuning::machine_for(get_jit_target_from_environment()).to_string();
    } else if (to_file || (argc == 2 && is(1, "--machine"))) {
      measure(to_file ? argv[3] : "");
    } else {
      return usage();
    }
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "tune: " << error.what() << "\n";
    return 1;
  }
}
