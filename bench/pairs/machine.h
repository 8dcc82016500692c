// machine.h -- what this machine can do at most, measured now.
#pragma once

namespace bench {

struct Machine {
  int threads = 1;
  double bytes_per_second = 0;  // all threads: McCalpin's STREAM triad, its way of counting
  double flops_one_thread = 0;  // single precision, a fused multiply-add being two
  double flops_all_threads = 0;

  double flops(int on_threads) const {
    return on_threads == 1 ? flops_one_thread : flops_all_threads;
  }
};

// On as many threads as the machine runs at once when none are asked for.
Machine measure_machine(int threads = 0);

// The least time that so much work can take.
double bound_seconds(const Machine& machine, int threads, double bytes, double operations);

}  // namespace bench
