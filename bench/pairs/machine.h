// machine.h -- measures the peak performance of this machine.
#pragma once

namespace bench {

struct Machine {
  int threads = 1;
  double bytes_per_second = 0;  // all threads: McCalpin's STREAM triad, with its counting
  double flops_one_thread = 0;  // single precision; a fused multiply-add counts as two
  double flops_all_threads = 0;

  double flops(int on_threads) const {
    return on_threads == 1 ? flops_one_thread : flops_all_threads;
  }
};

// Uses `threads` threads, or as many as the machine runs at once if it is 0.
Machine measure_machine(int threads = 0);

// The least time in which the machine can do this work.
double bound_seconds(const Machine& machine, int threads, double bytes, double operations);

}  // namespace bench
