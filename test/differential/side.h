// The two languages seen from the test: the same pipelines, built and run by each.
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
// The same definitions evaluated by the interpreter, with the error that Halide's freedom to
// reassociate allows.
std::vector<retrograde::oracle::Array> interpret(const std::string& name);

// Names of the schedules whose loops are shown.
std::vector<std::string> nest_names();
// print_loop_nest() of one, to the standard error stream.
void print_nest_in_halide(const std::string& name);
void print_nest_in_retrograde(const std::string& name);

}  // namespace differential
