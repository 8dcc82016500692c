// fit.h -- the training run: both languages take the same steps in turns, and every step is timed.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/state.h"
#include "groups.h"
#include "look.h"
#include "shape.h"

namespace bilateral_slice {

// The results of one language: the loss before each step, and the step's duration.
struct Series {
  double compile_seconds = 0;
  std::vector<double> loss;
  std::vector<double> seconds;

  void add(double step_loss, double step_seconds);
  double total_seconds() const;
  double median_ms() const;
};

struct FitOptions {
  int steps = 0;
  int threads = 0;
  double peer_seconds = 0;  // time limit for the peer; 0: no peer
  double seconds = 0;       // time limit for our steps; 0: no limit
  Groups moves = {};
  std::optional<Look> start = {};          // the initial look; without one, the identity
  std::optional<apps::State> resume = {};  // state of an earlier run to continue
};

struct Fit {
  Series ours, peer;          // peer is empty if it did not run
  std::string why_no_peer;    // not empty if the peer was requested but could not be measured
  std::vector<float> result;  // [channels, height, width], the photo through the learned look
  Look look;
  apps::State state;     // to continue the run later
  bool stopped = false;  // by a signal; the result contains what was learned until then
};

// Photo and target are planes as for Trainer. `progress(step, loss)` is called after each of our
// steps. Throws retrograde::Error.
Fit fit(const Shape& shape, std::vector<float>& photo, std::vector<float>& target,
        const FitOptions& options, const std::function<void(int, double)>& progress);

}  // namespace bilateral_slice
