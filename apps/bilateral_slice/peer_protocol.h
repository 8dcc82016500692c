// peer_protocol.h -- the messages between the program and the Halide peer, sent through pipes.
//
//   program -> peer   PeerJob, then the photo's and the target's planes (layout as for Trainer)
//   peer -> program   PeerReady, when its pipeline is compiled
//   then repeatedly:
//   program -> peer   int32 n, then n floats: the rates of the next n steps
//   peer -> program   n PeerSteps
//
// The peer exits when its standard input ends.
#pragma once

#include <cstdint>

namespace bilateral_slice {

struct PeerJob {
  int32_t width, height, channels, grid_x, grid_y, threads;
};

struct PeerReady {
  double compile_seconds;
};

struct PeerStep {
  double loss;  // before the step
  double seconds;
};

}  // namespace bilateral_slice
