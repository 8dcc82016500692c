// worker_protocol.h -- the protocol between the benchmark and its workers: lines of words through pipes. A worker is
// started as `worker KERNEL small|full THREADS [SCHEDULE]`.
//
//   worker  ready COMPILE_SECONDS START_SECONDS BYTES OPERATIONS [DERIVE_SECONDS SEARCH_SECONDS]
//                                                                   or   failed MESSAGE
//   driver  run           worker  ran SECONDS                       or   failed MESSAGE
//   driver  save PATH     worker  saved            writes each output as OutputHeader and elements
//   driver  inputs PATH   worker  saved RANK SIZES... RANK SIZES...    likewise; first the inputs with
//                                                  gradients, the seed last
//   driver  slope [PATH]  worker  slope ERROR      for a gradient that has run, see slope.h; PATH is
//                                                  the library of its program, if that is another one
//   driver  threads N     worker  set              for later runs; ours only
//   driver  explain PATH SECONDS  worker explained   Retrograde only: the schedule's report, as JSON
//   driver  memory        worker  memory PEAK_MB RUN_MB
//
// START_SECONDS: compiling and running a first, trivial pipeline, which makes each compiler do its one-time
// initialisation; COMPILE_SECONDS does not include it. PEAK_MB: the peak memory of the process. RUN_MB: the memory that
// the runs added to that.
//
// The worker ends when its standard input does, or by a signal after `worker_deadline_seconds`.
#pragma once

#include <cstdint>

namespace bench {

inline constexpr unsigned worker_deadline_seconds = 600;

struct OutputHeader {
  int32_t code, bits;  // as in halide_type_t
  int64_t count;
};

}  // namespace bench
