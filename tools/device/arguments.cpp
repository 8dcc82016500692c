#include "arguments.h"

#include <cstdlib>
#include <iostream>

namespace device_check {

void usage(const std::string& problem) {
  std::cerr << "gpu_check: " << problem
            << "\nusage: gpu_check [--simulated] [--output FILE] [--seconds N] [--random N] "
               "[--first-seed N] [--only NAME]... [--python PROGRAM]\n";
  std::exit(wrong_arguments);
}

namespace {

double number(const std::string& flag, const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end || !(value >= 0)) usage(flag + " needs a number, not \"" + text + "\"");
  return value;
}

}  // namespace

Arguments arguments_of(int argc, char** argv) {
  Arguments result;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    if (flag == "--simulated") {
      result.is_simulated = true;
      continue;
    }
    if (i + 1 == argc) usage(flag + " is not a flag, or needs a value");
    const std::string value = argv[++i];
    if (flag == "--output")
      result.output = value;
    else if (flag == "--python")
      result.python = value;
    else if (flag == "--seconds")
      result.seconds = number(flag, value);
    else if (flag == "--random")
      result.random = static_cast<int>(number(flag, value));
    else if (flag == "--first-seed")
      result.first_seed = static_cast<uint64_t>(number(flag, value));
    else if (flag == "--only")
      result.only.push_back(value);
    else if (flag == "--worker")
      result.worker = value;
    else if (flag == "--file")
      result.file = value;
    else if (flag == "--capability")
      result.capability = static_cast<int>(number(flag, value));
    else
      usage("there is no flag " + flag);
  }
  if (result.random < 0) result.random = result.is_simulated ? 5 : 2000;
  if (result.seconds < 0) result.seconds = result.is_simulated ? 10 : 540;
  return result;
}

}  // namespace device_check
