// demosaic: learns to demosaic, and demosaics pictures; see README.md. The inputs determine the task: photographs to
// learn from (--dataset), a picture to demosaic (--input), or a check.
#include <cstdio>

#include "checks.h"
#include "common/run_app.h"
#include "learn.h"
#include "measure.h"
#include "one_picture.h"
#include "options.h"
#include "shipped.h"

namespace demosaic {

namespace {

Weights given_weights(const Options& options) {
  if (options.weights.empty()) return shipped_weights(options.shape);
  return read_weights(options.weights);
}

void print(const apps::Table& table) { std::printf("%s", table.to_markdown().c_str()); }

void enter_methods(const std::vector<Measured>& methods, const Dataset& dataset,
                   apps::Report& report) {
  const apps::Table table = table_of(methods);
  report.add_table(table);
  report.add_plot(plot_of(methods));
  for (const Measured& m : methods) {
    auto& entry = report.own["methods"][m.name];
    entry = {{"psnr_srgb_db", m.mean.encoded_db},
             {"psnr_linear_db", m.mean.linear_db},
             {"ms_per_megapixel", m.ms_per_megapixel}};
    for (size_t n = 0; n < m.each.size(); ++n) {
      entry["photographs"][dataset.held_out[n].name] = m.each[n].encoded_db;
    }
  }
  report.add_note("divided " + dataset.division);
  print(table);
}

// In `methods`, bilinear and AHD come first and the learned method last.
void enter_gain(const std::vector<Measured>& methods, apps::Report& report) {
  const Measured &ahd = methods[1], &learned = methods.back();
  report.add_number("PSNR, held out", learned.mean.encoded_db, "dB", ahd.mean.encoded_db);
  report.add_number("PSNR in linear light", learned.mean.linear_db, "dB", ahd.mean.linear_db);
  report.add_number("time", learned.ms_per_megapixel, "ms per megapixel", ahd.ms_per_megapixel);
  report.own["gain_over_ahd_db"] = learned.mean.encoded_db - ahd.mean.encoded_db;
  report.own["gain_over_ahd_linear_db"] = learned.mean.linear_db - ahd.mean.linear_db;
}

void run(const Options& options) {
  const apps::RunScope scope(options.common);
  if (options.common.is_check()) return check(options);
  if (options.common.explain) explain(options);

  apps::Report report("demosaic", options.common);
  std::optional<Weights> weights;
  long steps = 0;
  bool stopped = false;
  if (!options.dataset.empty()) {
    const Dataset dataset = read_dataset(options.dataset);
    Gallery held_out(dataset.held_out);
    std::vector<Measured> methods;
    if (options.compare) {
      methods = measure_methods(held_out, options.common.threads, options.brief);
      if (options.time_steps) {
        const apps::Table times = time_steps(options, dataset);
        report.add_table(times);
        print(times);
      }
    } else {
      const Learned learned = learn(options, dataset, held_out, report);
      weights = learned.weights;
      steps = learned.steps;
      stopped = learned.stopped;
      methods = measure_methods(held_out, options.common.threads, options.brief);
      Demosaicker method = Demosaicker::relaxed(*weights, options.common.threads);
      methods.push_back(held_out.measure(method));
      methods.back().name += retrograde::text(", ", learned.steps, " steps");
      enter_gain(methods, report);
    }
    enter_methods(methods, dataset, report);
  }
  if (!options.common.input.empty()) {
    demosaic_input(options, weights ? *weights : given_weights(options), report);
  }
  report.write(steps, stopped);
  std::printf("results in %s\n", options.common.output.c_str());
}

}  // namespace

}  // namespace demosaic

int main(int argc, char** argv) {
  return apps::run_app("demosaic", argc, argv, [](int count, char** words) {
    if (const auto options = demosaic::read_options(count, words)) demosaic::run(*options);
  });
}
