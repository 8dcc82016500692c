// batch.cpp -- see batch.h.
//
// The loss of a step is that of one photo (stochastic gradients); Adam's moments run on over all of them.
// A look for all photographs cannot depend on the place in one of them, so the grid has three nodes along each
// side unless --grid says otherwise; what is left of the bilateral grid are its layers along the guide.
#include "batch.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <random>

#include "common/files.h"
#include "common/progress.h"
#include "common/report.h"
#include "common/stop.h"
#include "diagnostics/error.h"
#include "look.h"
#include "pairs.h"
#include "report.h"
#include "trainer.h"

namespace bilateral_slice {

using retrograde::quoted;
using retrograde::text;

namespace {

constexpr int longest_side = 384, batch_grid = 3, one_in_held_out = 5;
constexpr float batch_first_rate = 0.02f, batch_last_rate = 0.002f;

struct NamedPair {
  std::string name;
  Pair pair;  // at its own size
};

struct Photographs {
  std::vector<NamedPair> training, held_out;
};

Photographs read_photographs(const Options& options) {
  const bool own_targets = std::filesystem::is_directory(options.pairs / "target");
  std::vector<std::filesystem::path> files = apps::images_in(options.pairs);
  if (files.size() < 2) {
    retrograde::call_error(text("learn a look from ", quoted(options.pairs.string())),
                           "some photographs are learned from and others held out",
                           text("it has ", files.size()), "Give a folder with at least 2");
  }
  std::mt19937_64 random(options.seed);
  std::shuffle(files.begin(), files.end(), random);
  Photographs all;
  for (size_t n = 0; n < files.size(); ++n) {
    const auto target =
        own_targets ? options.pairs / "target" / files[n].filename() : std::filesystem::path();
    auto& to = n % one_in_held_out == 1 ? all.held_out : all.training;
    to.push_back({files[n].filename().string(), read_pair(files[n], target)});
  }
  return all;
}

// One size for all: the first photo's, its longer side shortened.
Shape training_shape(const Options& options, const Pair& first) {
  Shape shape = first.shape;
  const double factor =
      std::min(1.0, static_cast<double>(longest_side) / std::max(shape.width, shape.height));
  shape.width = std::max(static_cast<int>(shape.width * factor), 4);
  shape.height = std::max(static_cast<int>(shape.height * factor), 4);
  shape.grid_x = shape.grid_y = options.grid > 0 ? options.grid : batch_grid;
  return shape;
}

struct LearnedLook {
  Look look;
  std::vector<apps::LossSample> series;  // of each step's photo
  long steps = 0;
};

LearnedLook learn(const Options& options, const std::vector<NamedPair>& training) {
  const Shape shape = training_shape(options, training[0].pair);
  std::vector<Pair> small;
  for (const NamedPair& one : training)
    small.push_back(resized(one.pair, shape.width, shape.height));
  Trainer trainer(shape, small[0].photo.data(), small[0].target.data(), options.threads);
  apps::Progress progress(stderr, static_cast<int>(options.steps));
  std::mt19937_64 random(options.seed + 1);
  std::vector<size_t> order(small.size());
  std::iota(order.begin(), order.end(), size_t{0});
  LearnedLook out;
  const auto start = std::chrono::steady_clock::now();
  double seconds = 0;
  for (; out.steps < options.steps && !apps::stop_requested(); ++out.steps) {
    if (options.seconds > 0 && seconds >= options.seconds) break;
    const size_t at = static_cast<size_t>(out.steps) % order.size();
    if (at == 0) std::shuffle(order.begin(), order.end(), random);
    trainer.set_pair(small[order[at]].photo.data(), small[order[at]].target.data());
    const float share = static_cast<float>(out.steps) / static_cast<float>(options.steps);
    const double loss =
        trainer.step(batch_first_rate * std::pow(batch_last_rate / batch_first_rate, share));
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    out.series.push_back({out.steps, seconds, loss});
    progress.show(static_cast<int>(out.steps + 1), text(psnr_db(loss), " dB"));
  }
  out.look = look_of(shape, trainer);
  return out;
}

double psnr_between(const Planes& a, const Pair& pair) {
  return psnr_db(mean_squared_difference(a, pair.target, 3 * pair.shape.pixels()));
}

// Every photo through the look at its own size; a row for each, and the means.
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

void learn_from_pairs(const Options& options) {
  apps::Report report("bilateral_slice", options);
  Photographs photographs = read_photographs(options);
  const LearnedLook learned = learn(options, photographs.training);
  write_look(options.output / "look.bin", learned.look);
  apps::Table table{"photographs", {"photo", "", "PSNR before, dB", "after"}, {}};
  const Accuracy training = measure(learned.look, photographs.training, "learned from", table);
  const Accuracy held_out = measure(learned.look, photographs.held_out, "held out", table);
  write_pictures(options, learned.look, photographs.held_out[0], report);
  report.add_number("PSNR, photographs learned from", training.after, "dB", training.before);
  report.add_number("PSNR, photographs held out", held_out.after, "dB", held_out.before);
  report.add_table(table);
  report.add_plot({.title = "loss of each step's photo against run time",
                   .log_y = true,
                   .series = {apps::loss_series("one look for all", learned.series)}});
  report.own = {{"psnr_held_out_db", held_out.after},
                {"psnr_held_out_before_db", held_out.before},
                {"psnr_training_db", training.after},
                {"photographs", photographs.training.size()},
                {"held_out", photographs.held_out.size()}};
  report.write(learned.steps, apps::stop_requested());
  std::printf(
      "one look from %zu photographs: PSNR %.2f -> %.2f dB on %zu held out\nresults in %s\n",
      photographs.training.size(), held_out.before, held_out.after, photographs.held_out.size(),
      options.output.c_str());
}

}  // namespace bilateral_slice
