// ptxas.h -- checks generated PTX with NVIDIA's assembler, if it is installed.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>

#include "support/temporary_folder.h"

namespace retrograde {

inline bool has_ptxas() {
  static const bool has = std::system("ptxas --version > /dev/null 2>&1") == 0;
  return has;
}

// The errors of ptxas for the code and its chip (such as "sm_80"); empty: none. "-O0" in `options` runs the same checks
// in less time.
inline std::string ptxas_problem(const std::string& ptx, const std::string& chip,
                                 const std::string& options = "") {
  const TemporaryFolder folder;
  const auto file = [&](const char* name) { return (folder.path() / name).string(); };
  const std::string source = file("kernels.ptx"), said = file("said.txt");
  std::ofstream(source) << ptx;
  const std::string command = "ptxas --gpu-name " + chip + " " + options + " -o " +
                              file("kernels.cubin") + " " + source + " > " + said + " 2>&1";
  if (std::system(command.c_str()) == 0) return "";
  std::ifstream in(said);
  std::string text, line;
  for (int i = 0; i < 20 && std::getline(in, line); ++i) text += line + "\n";
  return text.empty() ? "ptxas failed and said nothing" : text;
}

}  // namespace retrograde
