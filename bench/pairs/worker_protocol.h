// worker_protocol.h -- what the benchmark and its workers say to each other: lines of words through
// pipes. A worker is started as `worker KERNEL small|full THREADS [SCHEDULE]`.
//
//   worker  ready COMPILE_SECONDS START_SECONDS BYTES OPERATIONS [DERIVE_SECONDS SEARCH_SECONDS]
//                                                                   or   failed MESSAGE
//   driver  run           worker  ran SECONDS                       or   failed MESSAGE
//   driver  save PATH     worker  saved            the outputs, as OutputHeader and elements, each
//   driver  inputs PATH   worker  saved RANK SIZES... RANK SIZES...    likewise; first those that
//                                                  gradients are by, the seed last
//   driver  slope [PATH]  worker  slope ERROR      of a gradient that has run, see slope.h; PATH is
//                                                  the library of its program, if that is another
//   driver  threads N     worker  set              for runs to come; ours only
//   driver  explain PATH SECONDS  worker explained   Retrograde: the schedule's report, as JSON
//   driver  memory        worker  memory PEAK_MB RUN_MB
//
// START_SECONDS: compiling and running a first, trivial pipeline, which makes each compiler set up
// what it needs once in a process; COMPILE_SECONDS holds none of that. PEAK_MB: the most that the
// process ever held. RUN_MB: how much the runs added to what it held before them.
//
// The worker ends when its standard input does, or after `worker_deadline_seconds` by a signal.
#pragma once

#include <cstdint>

namespace bench {

inline constexpr unsigned worker_deadline_seconds = 600;

struct OutputHeader {
  int32_t code, bits;  // as in halide_type_t
  int64_t count;
};

}  // namespace bench
