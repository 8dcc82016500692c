// batch.cpp -- see batch.h.
//
// Each step uses the loss of one photo (stochastic gradients); Adam's moments carry over from photo to photo. A look
// for all photographs must not depend on the position in one of them. So the grid has only three nodes along each side
// unless --grid sets another number, and its layers along the guide do most of the work.
#include "batch.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <random>

#include "common/division.h"
#include "common/files.h"
#include "common/progress.h"
#include "common/report.h"
#include "common/stop.h"
#include "common/timing.h"
#include "diagnostics/error.h"
#include "explain.h"
#include "look.h"
#include "pairs.h"
#include "report.h"
#include "trainer.h"
#include "trainer_state.h"

namespace bilateral_slice {

using retrograde::quoted;
using retrograde::text;

namespace {

constexpr int longest_side = 384, batch_grid = 3;
constexpr float batch_first_rate = 0.02f, batch_last_rate = 0.002f;

struct NamedPair {
  std::string name;
  Pair pair;  // at its own size
};

struct Photographs {
  std::vector<NamedPair> training, held_out;
  std::string division;  // in words
};

Photographs read_photographs(const Options& options) {
  const bool own_targets = std::filesystem::is_directory(options.pairs / "target");
  const auto pairs_of = [&](const std::vector<std::filesystem::path>& files) {
    std::vector<NamedPair> pairs;
    for (const auto& file : files) {
      const auto target =
          own_targets ? options.pairs / "target" / file.filename() : std::filesystem::path();
      pairs.push_back({file.filename().string(), read_pair(file, target)});
    }
    return pairs;
  };
  const apps::Division division = apps::division_of(options.pairs);
  return {pairs_of(division.train), pairs_of(division.held_out), division.words};
}

// Gives all photographs the same channels: three if any photograph or the initial look has colours.
void align_channels(const Options& options, const std::optional<Look>& start, Photographs& all) {
  bool colour = start && start->channels == 3;
  for (const auto* part : {&all.training, &all.held_out}) {
    for (const NamedPair& one : *part) {
      colour = colour || one.pair.shape.channels == 3;
      if (start) require_fits(*start, options.start.string(), one.pair.shape.channels, one.name);
    }
  }
  if (!colour) return;
  for (auto* part : {&all.training, &all.held_out}) {
    for (NamedPair& one : *part) make_colour(one.pair);
  }
}

// One size for all: that of the first photo, reduced so that its longer side fits.
Shape training_shape(const Options& options, const std::optional<Look>& start, const Pair& first) {
  Shape shape = first.shape;
  const double factor =
      std::min(1.0, static_cast<double>(longest_side) / std::max(shape.width, shape.height));
  shape.width = std::max(static_cast<int>(shape.width * factor), 4);
  shape.height = std::max(static_cast<int>(shape.height * factor), 4);
  shape.grid_x = shape.grid_y = options.grid > 0 ? options.grid : batch_grid;
  return start ? start->shape(shape.width, shape.height) : shape;
}

// The training steps, one photograph each, and the state for --resume.
class LookRun {
 public:
  LookRun(const Options& options, const std::optional<Look>& start, const Shape& shape,
          const std::vector<NamedPair>& training)
      : options_(options), small_(resized_to(shape, training)), random_(options.seed + 1) {
    for (const NamedPair& one : training) names_ += (names_.empty() ? "" : ", ") + one.name;
    std::optional<apps::State> state;
    if (options.resume) state = read_own_state(shape);
    trainer_.emplace(shape, small_[0].photo.data(), small_[0].target.data(), options.threads,
                     options.moves);
    order_.resize(small_.size());
    std::iota(order_.begin(), order_.end(), size_t{0});
    if (start) start_from(*start, *trainer_);
    if (state) restore_from(*state);
  }

  void run() {
    apps::Progress progress(stderr, static_cast<int>(options_.steps));
    const auto start = std::chrono::steady_clock::now();
    double seconds = 0;
    while (steps() < options_.steps && !apps::stop_requested()) {
      if (options_.seconds > 0 && seconds >= options_.seconds) break;
      const long before = steps();
      const double loss = step();
      seconds = apps::seconds_since(start);
      series_.push_back({before, seconds, loss});
      progress.show(static_cast<int>(steps()), text(psnr_db(loss), " dB"));
    }
  }

  long steps() const { return trainer_->steps(); }
  Look look() const { return look_of(trainer_->shape(), *trainer_); }
  const std::vector<apps::LossSample>& series() const {
    return series_;
  }  // per step, of that step's photo

  void save() const {
    apps::State state = state_of(*trainer_);
    state.program = state_program;
    state.words["photographs"] = names_;
    state.put("random", random_);
    state.arrays["order"].assign(order_.begin(), order_.end());
    apps::write_state(options_.output / "state.bin", state);
  }

 private:
  static constexpr const char* state_program = "bilateral_slice pairs";

  static std::vector<Pair> resized_to(const Shape& shape, const std::vector<NamedPair>& training) {
    std::vector<Pair> small;
    for (const NamedPair& one : training)
      small.push_back(resized(one.pair, shape.width, shape.height));
    return small;
  }

  double step() {
    const size_t at = static_cast<size_t>(steps()) % order_.size();
    if (at == 0) std::shuffle(order_.begin(), order_.end(), random_);
    Pair& pair = small_[order_[at]];
    trainer_->set_pair(pair.photo.data(), pair.target.data());
    const float share = static_cast<float>(steps()) / static_cast<float>(options_.steps);
    return trainer_->step(batch_first_rate * std::pow(batch_last_rate / batch_first_rate, share));
  }

  // Read before anything is compiled, so that a bad file is reported at once.
  apps::State read_own_state(const Shape& shape) const {
    apps::State state = apps::read_state(options_.output / "state.bin", state_program);
    require_same_run(state, shape, options_.moves);
    if (state.words["photographs"] != names_) {
      retrograde::call_error(
          "resume with these photographs",
          "a run goes on learning from those that it began with, and the others stay held out",
          text("it began with ", quoted(state.words["photographs"]), ", and now there are ",
               quoted(names_)),
          "Give the folder and the --seed of the run that is resumed, or leave out --resume");
    }
    return state;
  }

  void restore_from(const apps::State& state) {
    restore(*trainer_, state);
    state.get("random", random_);
    const auto& order = state.array("order", order_.size());
    std::copy(order.begin(), order.end(), order_.begin());
  }

  const Options& options_;
  std::vector<Pair> small_;
  std::mt19937_64 random_;
  std::string names_;  // of the photographs
  std::optional<Trainer> trainer_;
  std::vector<size_t> order_;  // random order of the photographs, redrawn once all were used
  std::vector<apps::LossSample> series_;
};

double psnr_between(const Planes& a, const Pair& pair) {
  return psnr_db(mean_squared_difference(a, pair.target, pair.shape.samples()));
}

// Applies the look to every photo at its own size: a table row for each, and the means.
struct Accuracy {
  double before = 0, after = 0;
};
Accuracy measure(const Look& look, std::vector<NamedPair>& photos, const std::string& kind,
                 apps::Table& table) {
  Accuracy mean;
  for (NamedPair& one : photos) {
    const double before = psnr_between(one.pair.photo, one.pair);
    const double after = psnr_between(through_look(look, one.pair.shape, one.pair.photo), one.pair);
    table.rows.push_back({one.name, kind, before, after});
    mean.before += before / static_cast<double>(photos.size());
    mean.after += after / static_cast<double>(photos.size());
  }
  return mean;
}

void write_pictures(const Options& options, const Look& look, NamedPair& one,
                    apps::Report& report) {
  const auto write = [&](const char* file, const Planes& planes, const std::string& caption) {
    apps::write_png(options.output / file, to_image(one.pair.shape, planes, one.pair.bits));
    report.add_picture(file, caption);
  };
  write("input.png", one.pair.photo, one.name + ", which was held out");
  write("target.png", one.pair.target, "the look that it shall have");
  write("result.png", through_look(look, one.pair.shape, one.pair.photo),
        "the look that was learned from the others");
}

}  // namespace

void learn_from_pairs(const Options& options, const std::optional<Look>& start) {
  apps::Report report("bilateral_slice", options);
  Photographs photographs = read_photographs(options);
  align_channels(options, start, photographs);
  const Shape shape = training_shape(options, start, photographs.training[0].pair);
  if (options.explain) explain(shape, options.moves);
  LookRun run(options, start, shape, photographs.training);
  run.run();
  const Look look = run.look();
  write_look(options.output / "look.bin", look);
  run.save();
  apps::Table table{"photographs", {"photo", "", "PSNR before, dB", "after"}, {}};
  const Accuracy training = measure(look, photographs.training, "learned from", table);
  const Accuracy held_out = measure(look, photographs.held_out, "held out", table);
  write_pictures(options, look, photographs.held_out[0], report);
  report.add_note("divided " + photographs.division);
  report.add_number("PSNR, photographs learned from", training.after, "dB", training.before);
  report.add_number("PSNR, photographs held out", held_out.after, "dB", held_out.before);
  report.add_table(table);
  report.add_plot({.title = "loss of each step's photo against run time",
                   .log_y = true,
                   .series = {apps::loss_series("one look for all", run.series())}});
  report.own = {
      {"psnr_held_out_db", held_out.after},         {"psnr_held_out_before_db", held_out.before},
      {"psnr_training_db", training.after},         {"channels", shape.channels},
      {"left_out", left_out(shape, options.moves)}, {"photographs", photographs.training.size()},
      {"held_out", photographs.held_out.size()}};
  report.write(run.steps(), apps::stop_requested());
  std::printf(
      "one look from %zu photographs: PSNR %.2f -> %.2f dB on %zu held out\nresults in %s\n",
      photographs.training.size(), held_out.before, held_out.after, photographs.held_out.size(),
      options.output.c_str());
}

}  // namespace bilateral_slice
