// generator_main.cpp -- main() of the programs that build files call; linked with the generators of a user.
#include <unistd.h>

#include <iostream>

#include "generator/command_line.h"

namespace {

// Ends the program by SIGALRM after the time limit, so that a build cannot hang.
void limit_time(int argc, char** argv) {
  try {
    alarm(
        static_cast<unsigned>(retrograde::internal::read_command_line(argc, argv).timeout_seconds));
  } catch (const std::exception&) {  // generate_filter_main reports it
  }
}

}  // namespace

int main(int argc, char** argv) {
  limit_time(argc, argv);
  return retrograde::internal::generate_filter_main(argc, argv, std::cerr);
}
