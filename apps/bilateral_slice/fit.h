// fit.h -- the run: both languages take the same steps, in turns, and every step is timed.
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

// What one language did: the loss before each step, and how long the step took.
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
  double peer_seconds = 0;  // no more blocks of the peer after this long; 0: no peer
  double seconds = 0;       // of our steps; 0: no limit
  Groups moves = {};
  std::optional<Look> start = {};          // a look to begin with; without one, the identity
  std::optional<apps::State> resume = {};  // of an earlier run, which this one goes on with
};

struct Fit {
  Series ours, peer;          // peer is empty when it was left out
  std::string why_no_peer;    // not empty: the peer was asked for and could not be measured
  std::vector<float> result;  // [channels, height, width], the photo through the learned look
  Look look;
  apps::State state;     // for a run that goes on
  bool stopped = false;  // by a signal: what was learned until then is in here
};

// Photo and target are planes as for Trainer. `progress(step, loss)` is called after each of our
// steps. Throws retrograde::Error.
Fit fit(const Shape& shape, std::vector<float>& photo, std::vector<float>& target,
        const FitOptions& options, const std::function<void(int, double)>& progress);

}  // namespace bilateral_slice
