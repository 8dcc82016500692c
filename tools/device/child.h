// child.h -- runs a program and waits for it, with a time limit.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace device_check {

struct Ended {
  int status =
      -1;  // the exit status; 128 plus the signal's number if a signal ended it; -1 if it was not started
  bool timed_out = false;
  std::string out, err;
  bool succeeded() const { return status == 0 && !timed_out; }
};

// words[0] is searched in PATH. `environment`: variables that differ from ours.
Ended run_child(const std::vector<std::string>& words,
                const std::map<std::string, std::string>& environment, double seconds);

// The program's path; empty if neither PATH nor `folders` contain it.
std::string find_program(const std::string& name, const std::vector<std::string>& folders = {});

}  // namespace device_check
