// Measured tuning: the database of results and its reuse, invalid files, fitted machine parameters.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "database.h"
#include "fit_database.h"
#include "frontend/include/retrograde/retrograde.h"
#include "graph/graph.h"
#include "graph/names.h"
#include "support/errors.h"
#include "tune_program.h"
#include "tuning/fit_machine.h"

namespace retrograde {
namespace {

using planning::Machine;
using tuning::FitSample;

class Tune : public testing::Test {
 protected:
  Tune() { std::filesystem::create_directories(folder_); }
  ~Tune() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return folder_ + "/" + name; }

 private:
  const std::string folder_ =
      testing::TempDir() + "retrograde_tune_test_" + std::to_string(getpid());
};

std::string contents_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A matrix product and a consumer, which have several schedules. Built once, since names contain
// numbers.
const std::string& program() {
  static const std::string text = [] {
    Var x("x"), y("y");
    RDom k(0, 96, "k");
    ImageParam a(Float(32), 2, "a"), b(Float(32), 2, "b");
    Func product("product"), rows("rows"), out("out");
    a.dim(0).set_estimate(0, 96).dim(1).set_estimate(0, 96);
    b.dim(0).set_estimate(0, 96).dim(1).set_estimate(0, 96);
    const Func read_b = b;  // the image is read through a Func
    product(x, y) += a(k, y) * read_b(x, k);
    rows(x, y) = exp(product(x, y)) + product(x, y + 1);
    out(x, y) = rows(x, y) + rows(x + 1, y) * rows(x + 2, y);
    out.set_estimate(x, 0, 90).set_estimate(y, 0, 90);
    return graph::to_text(graph::graph_of({out.function()}));
  }();
  return text;
}

struct Told {
  int now = -1, before = -1, left = -1;
};
Told tuned(const std::string& database, int limit, const std::string& output = "") {
  tune::Options options;
  options.run_seconds = 0.001;
  options.limit = limit;
  options.threads = 2;
  options.output = output;
  std::ostringstream out;
  tune::Database opened(database);
  tune::tune_program("product", program(), options, opened, out);
  Told told;
  const std::string text = out.str();
  const size_t at = text.find("measured now");
  if (at != std::string::npos)
    std::sscanf(text.c_str() + at, "measured now: %d, before: %d, left: %d", &told.now,
                &told.before, &told.left);
  return told;
}

TEST_F(Tune, ASecondRunGoesOnWhereTheFirstWasStopped) {
  const std::string database = path("measured.sqlite");
  const Told first = tuned(database, 2);
  EXPECT_EQ(first.now, 2);
  EXPECT_EQ(first.before, 0);
  ASSERT_GT(first.left, 0);
  const Told second = tuned(database, 0);
  EXPECT_EQ(second.before, 2);
  EXPECT_EQ(second.now, first.left);
  EXPECT_EQ(second.left, 0);
  const Told third = tuned(database, 0);
  EXPECT_EQ(third.now, 0);
  EXPECT_EQ(third.before, first.left + 2);
}

TEST_F(Tune, TheBestScheduleIsWrittenAsALogThatReplays) {
  tuned(path("measured.sqlite"), 0, path(""));
  const ScheduleLog log = ScheduleLog::parse(contents_of(path("product.schedule")));
  EXPECT_GT(log.size(), 0u);
  graph::Graph graph = graph::parse_graph(program());
  const auto scheduled = graph::with_log(log, graph.outputs);
  // The copies that a schedule creates have different names in each graph.
  EXPECT_EQ(graph::without_numbers(graph::schedule_log(scheduled).to_text()),
            graph::without_numbers(log.to_text()));
  EXPECT_NE(contents_of(path("product.cpp")).find("out"), std::string::npos);
}

TEST_F(Tune, WhatIsNoDatabaseIsSaidAndLeft) {
  std::ofstream(path("notes.txt")) << std::string(4096, 'n');
  try {
    tune::Database database(path("notes.txt"));
    FAIL() << "it was opened";
  } catch (const Error& error) {
    EXPECT_FALSE(error.message().asked.empty() || error.message().rule.empty() ||
                 error.message().evidence.empty() || error.message().instead.empty());
    expect_mentions(error.what(), {"notes.txt", "a database of tools/tune"});
  }
  EXPECT_EQ(contents_of(path("notes.txt")), std::string(4096, 'n'));
}

TEST_F(Tune, ADatabaseThatIsCutOffIsSaidAndLeft) {
  const std::string file = path("measured.sqlite");
  {
    tune::Database database(file);
    database.candidate(database.program("p", std::string(20000, 'p')), "log", "graph");
  }
  std::filesystem::resize_file(file, 6000);
  const std::string before = contents_of(file);
  const auto use = [&] {
    tune::Database database(file);
    database.candidate(database.program("q", "q"), "log", "graph");
  };
  EXPECT_THROW(use(), UserError);
  EXPECT_EQ(contents_of(file), before);
}

TEST_F(Tune, FittingWantsMeasurements) {
  tune::Database database(path("measured.sqlite"));
  std::ostringstream out;
  try {
    tune::fit_database(database, 2, out);
    FAIL() << "nothing was fitted";
  } catch (const UserError& error) {
    expect_mentions(error.what(), {"measurements of this machine", "Measure some programs first"});
  }
}

TEST_F(Tune, MeasurementsFitTheModelAndHalfOfTheProgramsTestIt) {
  const std::string database = path("measured.sqlite");
  tuned(database, 3);
  tune::Database opened(database);
  std::ostringstream out;
  const Machine machine = tune::fit_database(opened, 2, out);
  EXPECT_GT(machine.operation_ns, 0);
  expect_mentions(out.str(), {"all: 3 schedules", "arithmetic", "launch"});
}

// ---- fitted machine parameters ----

// Levels of one byte per nanosecond weigh as much as operations in the samples.
Machine start_of_fit() {
  Machine machine;
  for (Machine::Level& level : machine.levels) level.one_thread = level.all_threads = 1;
  return machine;
}

std::vector<FitSample> synthetic(const Machine& truth) {
  std::vector<FitSample> samples;
  for (int i = 0; i < 40; i++) {
    const auto share = [i](int k) {
      return 1.0 + ((i * (2 * k + 3) + k * k) % 11) * (i % (k + 2));
    };
    const auto predict = [=](const Machine& m) {
      return 1e-9 * (share(0) * m.operation_ns + share(1) * m.load_ns + share(2) * m.store_ns +
                     share(3) / m.levels[1].one_thread + share(4) / m.levels[3].one_thread +
                     share(5) * m.launch_ns / 1000);
    };
    samples.push_back({predict, predict(truth)});
  }
  return samples;
}

TEST(FitMachine, FindsTheFactorsThatMeasurementsWereMadeWith) {
  const Machine start = start_of_fit();
  Machine truth = start;
  truth.operation_ns *= 1.5;
  truth.load_ns *= 0.7;
  truth.launch_ns *= 2;
  truth.levels[3].one_thread /= 1.8;
  const tuning::MachineFit fit = tuning::fit_machine(start, synthetic(truth));
  EXPECT_LT(fit.error_after, 1.05);
  EXPECT_LT(fit.error_after, fit.error_before);
  EXPECT_NEAR(fit.machine.launch_ns / start.launch_ns, 2, 0.3);
  EXPECT_NEAR(start.levels[3].one_thread / fit.machine.levels[3].one_thread, 1.8, 0.5);
}

TEST(FitMachine, WhatSamplesDoNotSayStays) {
  const Machine start = start_of_fit();
  const tuning::MachineFit fit = tuning::fit_machine(start, synthetic(start));
  EXPECT_EQ(fit.machine, start);
  const tuning::MachineFit none = tuning::fit_machine(start, {});
  EXPECT_EQ(none.machine, start);
}

TEST(FitMachine, FactorsAreBounded) {
  const Machine start = start_of_fit();
  Machine truth = start;
  truth.operation_ns *= 1000;
  for (const tuning::FittedTerm& term : tuning::fit_machine(start, synthetic(truth)).terms) {
    EXPECT_LE(term.factor, 4.0001) << term.name;
    EXPECT_GE(term.factor, 0.2499) << term.name;
  }
}

}  // namespace
}  // namespace retrograde
