// fit.cpp -- see fit.h.
//
// The two languages alternate in blocks of a few steps, so that other load on the machine affects both alike. While one
// runs, the other sleeps: the peer waits for its next request, and our threads wait for the next loop.
#include "fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <string>

#include "common/stop.h"
#include "common/timing.h"
#include "diagnostics/error.h"
#include "peer.h"
#include "render.h"
#include "trainer.h"
#include "trainer_state.h"

namespace bilateral_slice {

namespace {

constexpr int block_steps = 5;
constexpr float first_rate = 0.03f, last_rate = 0.003f;

using Clock = std::chrono::steady_clock;

float rate_of(int step, int steps) {
  return first_rate * std::pow(last_rate / first_rate, static_cast<float>(step) / steps);
}

std::vector<float> rates_of(int first, int count, int steps) {
  std::vector<float> rates;
  for (int s = first; s < first + count; ++s) rates.push_back(rate_of(s, steps));
  return rates;
}

// Runs the peer until its time limit or its failure; a failure does not end our run.
class PeerRun {
 public:
  PeerRun(const Shape& shape, const std::vector<float>& photo, const std::vector<float>& target,
          const FitOptions& options, Fit& fit)
      : options_(options), fit_(fit) {
    if (options.peer_seconds <= 0) return;
    if (!options.moves.all() || options.start) {
      fit_.why_no_peer =
          "cannot measure Halide 14: its peer begins at the identity and moves grid, mix and "
          "curve; "
          "this run does something else. Leave out --optimize and --start to measure both.";
      return;
    }
    guarded([&] {
      const auto program = Peer::find();
      if (program.empty()) {
        fit_.why_no_peer =
            "cannot measure Halide 14: its peer program is installed with this one; "
            "no bilateral_slice_halide_peer was found. tools/build makes both.";
        return;
      }
      peer_.emplace(program, shape, photo, target, options.threads);
      fit_.peer.compile_seconds = peer_->compile_seconds();
    });
  }

  void run_block(int first, int count) {
    if (!peer_ || fit_.peer.total_seconds() > options_.peer_seconds) return;
    guarded([&] {
      for (const PeerStep& step : peer_->run(rates_of(first, count, options_.steps))) {
        fit_.peer.add(step.loss, step.seconds);
      }
    });
  }

 private:
  template <typename Body>
  void guarded(Body&& body) {
    try {
      body();
    } catch (const retrograde::Error& error) {
      fit_.why_no_peer = error.what();
      fit_.peer = Series();
      peer_.reset();
    }
  }

  const FitOptions& options_;
  Fit& fit_;
  std::optional<Peer> peer_;
};

}  // namespace

void Series::add(double step_loss, double step_seconds) {
  loss.push_back(step_loss);
  seconds.push_back(step_seconds);
}

double Series::total_seconds() const {
  return std::accumulate(seconds.begin(), seconds.end(), 0.0);
}

double Series::median_ms() const {
  return 1e3 * apps::median(seconds);  // 0 if a finished run was resumed
}

Fit fit(const Shape& shape, std::vector<float>& photo, std::vector<float>& target,
        const FitOptions& options, const std::function<void(int, double)>& progress) {
  Fit fit;
  const auto start = Clock::now();
  Trainer trainer(shape, photo.data(), target.data(), options.threads, options.moves);
  fit.ours.compile_seconds = apps::seconds_since(start);
  if (options.start) start_from(*options.start, trainer);
  if (options.resume) restore(trainer, *options.resume);
  PeerRun peer(shape, photo, target, options, fit);

  const auto time_is_over = [&] {
    return options.seconds > 0 && fit.ours.total_seconds() >= options.seconds;
  };
  for (int first = trainer.steps();
       first < options.steps && !apps::stop_requested() && !time_is_over(); first += block_steps) {
    const int count = std::min(block_steps, options.steps - first);
    for (int step = first; step < first + count; ++step) {
      const auto before = Clock::now();
      const double loss = trainer.step(rate_of(step, options.steps));
      fit.ours.add(loss, apps::seconds_since(before));
      progress(step + 1, loss);
    }
    peer.run_block(first, count);
  }
  fit.stopped = apps::stop_requested();
  fit.state = state_of(trainer);
  fit.look = look_of(shape, trainer);
  fit.result.resize(shape.samples());
  render(shape, photo.data(), trainer.grid(), trainer.mix(), trainer.curve(), fit.result.data());
  return fit;
}

}  // namespace bilateral_slice
