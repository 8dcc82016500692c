// Random programs under random schedules, and with the default schedule: plans keep them.
//
// RETROGRADE_PLAN_GRAPHS names a folder of graphs, such as one that RETROGRADE_GRAPHS made: their default schedules are
// tried, too.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "driver/plan_schedule.h"
#include "driver/schedule.h"
#include "graph/graph.h"
#include "support/plan_round_trip.h"
#include "support/program_counts.h"
#include "testing/random_schedule.h"

namespace retrograde {
namespace {

namespace fs = std::filesystem;

class Count {
 public:
  void add(const PlanRoundTrip& trip) {
    ++programs;
    funcs += trip.funcs;
    for (const auto& [why, count] : trip.opaque) opaque[why] += count;
    if (!trip.broken.empty()) ++broken[trip.broken.substr(0, 2)];
  }
  int programs = 0, funcs = 0;
  std::map<planning::Opacity, int> opaque;
  std::map<std::string, int> broken;  // programs that break an invariant

  int opaque_funcs() const {
    int sum = 0;
    for (const auto& [why, count] : opaque) sum += count;
    return sum;
  }
  void print(const std::string& what) const {
    std::cout << what << ": " << programs << " programs, " << funcs << " Funcs, " << opaque_funcs()
              << " opaque";
    for (const auto& [why, count] : opaque) std::cout << ", " << opacity_name(why) << " " << count;
    for (const auto& [rule, count] : broken) std::cout << "; " << rule << " broken by " << count;
    std::cout << "\n";
  }
};

// Programs that lowering refuses are not compared.
void try_schedule(const std::vector<graph::FuncPtr>& outputs, Count& count, bool keeps_invariants,
                  const std::string& stop_after = "build_loop_nests") {
  std::string pass = stop_after;
  try {
    lowered_text(graph::apply_wrappers(outputs), get_host_target(), stop_after);
  } catch (const Error&) {
    pass.clear();
  }
  try {
    const PlanRoundTrip trip = plan_round_trip(outputs, get_host_target(), pass);
    count.add(trip);
    EXPECT_EQ(trip.failure, "");
    if (keeps_invariants) {
      EXPECT_EQ(trip.broken, "") << graph::schedule_log(outputs).to_text();
    }
  } catch (const Error& e) {
    ADD_FAILURE() << e.what() << "\n" << graph::to_text(graph::graph_of(outputs));
  }
}

constexpr int programs_of_each = many_or_few(1000, 60);

TEST(PlanRoundTrips, RandomSchedules) {
  Count count;
  for (int seed = 1; seed <= programs_of_each; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    fuzz::Choices choices(static_cast<uint64_t>(seed));
    const bool has_chains = seed % 2 == 0;
    const auto program =
        fuzz::make_program(choices, has_chains ? fuzz::Style::chains() : fuzz::Style::pipelines());
    const auto style = has_chains ? fuzz::ScheduleStyle::windows() : fuzz::ScheduleStyle();
    fuzz::apply(fuzz::random_schedule(program, choices, style), program);
    try_schedule(fuzz::outputs_of(program), count, false);
  }
  count.print("random schedules");
  EXPECT_LT(count.opaque_funcs(), count.funcs / 2);
}

TEST(PlanRoundTrips, DefaultSchedulesOfRandomPrograms) {
  Count count, everything;
  for (int seed = 1; seed <= programs_of_each; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    fuzz::Choices choices(static_cast<uint64_t>(seed));
    const auto program = fuzz::make_program(choices, fuzz::Style::gradients());
    const std::vector<graph::FuncPtr> outputs = fuzz::outputs_of(program);
    try_schedule(driver::schedule_unscheduled(outputs), count, true);
    try_schedule(
        driver::schedule_by_plan(graph::apply_wrappers(outputs), {}, driver::Scheduling::Everything)
            .outputs,
        everything, true);
  }
  count.print("default schedules");
  everything.print("with everything scheduled");
  EXPECT_EQ(count.opaque_funcs(), 0);
  EXPECT_EQ(everything.opaque_funcs(), 0);
}

TEST(PlanRoundTrips, DefaultSchedulesOfKeptGraphs) {
  const char* folder = std::getenv("RETROGRADE_PLAN_GRAPHS");
  if (!folder) GTEST_SKIP() << "RETROGRADE_PLAN_GRAPHS names no folder";
  Count count, everything, on_device;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".graph") continue;
    SCOPED_TRACE(entry.path().filename().string());
    std::ifstream in(entry.path());
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto outputs = [&] { return graph::parse_graph(text).outputs; };
    try_schedule(driver::schedule_unscheduled(outputs()), count, false);
    for (const bool on_gpu : {false, true}) {
      driver::ScheduleRequest request;
      request.on_gpu = on_gpu;
      std::vector<graph::FuncPtr> scheduled;
      try {
        scheduled = driver::schedule_by_plan(graph::apply_wrappers(outputs()), request,
                                             driver::Scheduling::Everything)
                        .outputs;
      } catch (const Error&) {
        continue;  // a device cannot compute it
      }
      try_schedule(scheduled, on_gpu ? on_device : everything, false);
    }
  }
  count.print("kept graphs");
  everything.print("with everything scheduled");
  on_device.print("on a device");
}

}  // namespace
}  // namespace retrograde
