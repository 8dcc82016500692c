// tune.cpp -- see tune.h.
#include "tune.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "common/stop.h"
#include "measure.h"

namespace deconvolution {

namespace {

constexpr int side = 192;
constexpr double first_step = 4;
constexpr int refinements = 3;  // of the step: 4, 2, 1.41

struct Number {
  const char* name;
  double Priors::*value;
  double most;
};
constexpr std::array<Number, 5> numbers{
    {{"lambda, first stage", &Priors::first_weight, 1e3},
     {"lambda, second stage", &Priors::second_weight, 1e3},
     {"threshold of first derivatives", &Priors::first_threshold, 1e3},
     {"threshold of second derivatives", &Priors::second_threshold, 1e3},
     {"mix of the cleaned image", &Priors::mix, 1}}};

class Scan {
 public:
  Scan(const Options& options, const demosaic::Dataset& dataset)
      : gallery_(dataset.train, options.noise, side),
        method_({"tuned", original()}, gallery_.extent(), options.common.threads) {}

  void run() {
    const auto published = measure(best_);
    if (!published) return;
    best_db_ = published_db_ = *published;
    double step = first_step;
    for (int k = 0; k < refinements; ++k, step = std::sqrt(step)) {
      for (const Number& number : numbers) improve(number, step);
    }
  }

  const Priors& best() const { return best_; }
  double best_db() const { return best_db_; }
  double published_db() const { return published_db_; }

 private:
  // Nothing if it is stopped.
  std::optional<double> measure(const Priors& priors) {
    method_.use({"tuned", original(priors)});
    const auto measured = gallery_.measure(method_);
    if (!measured) return std::nullopt;
    return measured->mean_db;
  }

  void improve(const Number& number, double step) {
    for (const double factor : {step, 1 / step}) {
      bool better = true;
      while (better && !apps::stop_requested()) better = try_factor(number, factor);
    }
  }

  bool try_factor(const Number& number, double factor) {
    Priors next = best_;
    next.*number.value *= factor;
    if (next.*number.value > number.most) return false;
    const auto db = measure(next);
    if (!db || !(*db > best_db_)) return false;
    best_db_ = *db;
    best_ = next;
    std::printf("%-32s %9.4g: %.3f dB\n", number.name, best_.*number.value, *db);
    return true;
  }

  Gallery gallery_;
  Deconvolver method_;
  Priors best_;
  double best_db_ = NAN, published_db_ = NAN;
};

}  // namespace

void tune(const Options& options, const demosaic::Dataset& dataset, apps::Report& report) {
  Scan scan(options, dataset);
  scan.run();
  apps::Table table{"numbers of the original method", {"number", "published", "tuned"}, {}};
  for (const Number& number : numbers) {
    table.rows.push_back({number.name, Priors().*number.value, scan.best().*number.value});
  }
  report.add_table(table);
  report.add_number("PSNR, training photographs", scan.best_db(), "dB", scan.published_db());
  std::printf("%s", table.to_markdown().c_str());
  write_weights(options.common.output / "tuned.json", original(scan.best()),
                "a scan over training photographs");
}

}  // namespace deconvolution
