// machine_main.cpp -- prints this machine's peak performance with a number of threads, for benchmarks in Python.
#include <cstdio>
#include <cstdlib>

#include "machine.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s THREADS\n", argv[0]);
    return 2;
  }
  const bench::Machine machine = bench::measure_machine(std::atoi(argv[1]));
  std::printf("{\"threads\": %d, \"bytes_per_second\": %.4g, \"flops\": %.4g}\n", machine.threads,
              machine.bytes_per_second, machine.flops_all_threads);
}
