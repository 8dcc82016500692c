// child.h -- a program that is run and waited for, so long and no longer.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace device_check {

struct Ended {
  int status =
      -1;  // as exit() had it; 128 and the signal's number where one ended it; -1: not started
  bool timed_out = false;
  std::string out, err;
  bool succeeded() const { return status == 0 && !timed_out; }
};

// words[0] is looked for in PATH. `environment`: what differs from ours.
Ended run_child(const std::vector<std::string>& words,
                const std::map<std::string, std::string>& environment, double seconds);

// The program's path; empty where no folder of PATH, and none of these, has it.
std::string find_program(const std::string& name, const std::vector<std::string>& folders = {});

}  // namespace device_check
