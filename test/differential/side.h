// The interface between the test and the two languages: the same pipelines, built and run by each.
#pragma once

#include <HalideBuffer.h>

#include <string>
#include <vector>

#include "testing/array.h"

namespace differential {

using HostBuffer = Halide::Runtime::Buffer<>;

// Names of all pipelines, in the order of their definition.
std::vector<std::string> case_names();

// Builds the pipeline in Halide 14, with its schedule or without, and realizes it.
std::vector<HostBuffer> run_in_halide(const std::string& name, bool scheduled);
// The same source compiled against Retrograde.
std::vector<HostBuffer> run_in_retrograde(const std::string& name, bool scheduled);
// The same definitions evaluated by the interpreter, with error bounds that allow for Halide's
// reassociation.
std::vector<retrograde::oracle::Array> interpret(const std::string& name);

// Names of the schedules whose loop nests are printed.
std::vector<std::string> nest_names();
// print_loop_nest() of one of them, to standard error.
void print_nest_in_halide(const std::string& name);
void print_nest_in_retrograde(const std::string& name);

}  // namespace differential
