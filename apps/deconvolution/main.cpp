// deconvolution: sharpens blurred photographs; see README.md. The inputs determine the task: photographs to learn from
// (--dataset), a picture to deconvolve (--input), or a check.
#include <cstdio>
#include <optional>

#include "checks.h"
#include "common/run_app.h"
#include "common/stop.h"
#include "learn.h"
#include "measure.h"
#include "one_picture.h"
#include "options.h"
#include "tune.h"

namespace deconvolution {

namespace {

void print(const apps::Table& table) { std::printf("%s", table.to_markdown().c_str()); }

void enter(const Gallery& gallery, const std::vector<Measured>& methods, apps::Report& report) {
  const double blurred = gallery.blurred_db();
  for (const apps::Table& table : {table_of(blurred, methods), details_of(gallery, methods)}) {
    report.add_table(table);
    print(table);
  }
  report.own["held_out"]["blurred"] = blurred;
  for (const Measured& m : methods) report.own["held_out"][m.name] = m.mean_db;
  const Measured &first = methods.front(), &last = methods.back();
  report.add_number("PSNR, held out", last.mean_db, "dB", first.mean_db, "at least +0.8");
  report.own["gain_db"] = last.mean_db - first.mean_db;
}

std::vector<Method> methods_of(const Options& options) {
  if (options.tune || options.brief) return {{"original", original()}};
  std::vector<Method> methods = shipped_methods();
  if (!options.weights.empty()) methods.back().weights = read_weights(options.weights);
  return methods;
}

// A stopped run makes no comparisons, so that the user does not wait.
void enter_stopped(const std::optional<Learned>& learned, apps::Report& report) {
  report.add_note("stopped before any method was measured");
  if (!learned || learned->held_out.each_db.empty()) return;
  const Measured& m = learned->held_out;
  report.own["held_out"][m.name] = m.mean_db;
  report.add_number("PSNR, held out", m.mean_db, "dB");
}

// The task with photographs: scan, learn or measure. Returns the number of steps.
long use_dataset(const Options& options, std::vector<Method>& methods, apps::Report& report) {
  const auto dataset = demosaic::read_dataset(options.dataset);
  report.add_note("divided " + dataset.division);
  if (options.tune) {
    tune(options, dataset, report);
    return 0;
  }
  const Gallery gallery(dataset.held_out, options.noise, usual_side);
  std::optional<Learned> learned;
  if (!options.compare) learned = learn(options, dataset, gallery, report);
  std::vector<Measured> measured = gallery.measure(methods, options.common.threads);
  if (learned) methods.push_back({learned->held_out.name, learned->weights});
  if (measured.empty()) {
    enter_stopped(learned, report);
  } else {
    if (learned) measured.push_back(learned->held_out);
    enter(gallery, measured, report);
  }
  return learned ? learned->steps : 0;
}

void run(const Options& options) {
  const apps::RunScope scope(options.common);
  if (options.common.is_check()) return check(options);
  if (options.common.explain) explain(options);

  apps::Report report("deconvolution", options.common);
  std::vector<Method> methods = methods_of(options);
  long steps = 0;
  if (!options.dataset.empty()) steps = use_dataset(options, methods, report);
  const bool stopped_before = !options.dataset.empty() && apps::stop_requested();
  if (!options.common.input.empty() && !stopped_before)
    steps += deconvolve_input(options, methods, report);
  report.write(steps, apps::stop_requested());
  std::printf("results in %s\n", options.common.output.c_str());
}

}  // namespace

}  // namespace deconvolution

int main(int argc, char** argv) {
  return apps::run_app("deconvolution", argc, argv, [](int count, char** words) {
    if (const auto options = deconvolution::read_options(count, words))
      deconvolution::run(*options);
  });
}
