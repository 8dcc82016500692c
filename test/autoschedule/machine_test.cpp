// The descriptions of processors and GPUs: the limits of schedules that follow from them, and their text form.
#include "autoschedule/machine/machine.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "autoschedule/machine/device.h"
#include "autoschedule/machine/kept_machine.h"
#include "driver/schedule_request.h"
#include "frontend/include/retrograde/retrograde.h"
#include "support/errors.h"
#include "tuning/keep_machine.h"

namespace retrograde {
namespace {

using planning::Machine;

const Target wide_target("x86-64-linux-avx512");

Machine constants() { return planning::constants_for(wide_target); }

// ---- constants ----

TEST(Machine, ReferenceIsTheDefault) {
  EXPECT_EQ(planning::reference_machine(wide_target), Machine());
  EXPECT_EQ(planning::reference_machine(wide_target).threads, 2);
}

TEST(Machine, TargetsDifferInTheirVectors) {
  const auto registers_of = [](const char* target) {
    const Machine m = planning::reference_machine(Target(target));
    return std::tuple(m.registers, m.vector_bytes, m.accumulator_bytes());
  };
  EXPECT_EQ(registers_of("x86-64-linux-avx512-avx512_skylake"), std::tuple(32, 64, 1536));
  EXPECT_EQ(registers_of("x86-64-linux-avx512_skylake"), std::tuple(16, 64, 768));
  EXPECT_EQ(registers_of("x86-64-linux-avx512"), std::tuple(32, 64, 1536));
  EXPECT_EQ(registers_of("x86-64-linux-avx2"), std::tuple(16, 32, 384));
  EXPECT_EQ(registers_of("x86-64-linux"), std::tuple(16, 16, 192));
  EXPECT_EQ(registers_of("arm-64-linux"), std::tuple(32, 16, 384));
}

// A change of these figures changes schedules.
TEST(Machine, LimitsFollowFromCachesAndThreads) {
  Machine m;
  EXPECT_EQ(m.enough_tasks(), 8);
  EXPECT_EQ(m.near_cache_bytes(), 1 << 20);
  EXPECT_EQ(m.task_bytes(), 384 << 10);
  EXPECT_EQ(m.last_cache_bytes(), 16 << 20);
  m.threads = 1;
  EXPECT_EQ(m.enough_tasks(), 8) << "as for the reference threads";
  m.threads = 6;
  EXPECT_EQ(m.enough_tasks(), 24);
  m.levels[Machine::last_cache].bytes = 1e30;
  EXPECT_EQ(m.last_cache_bytes(), INT64_MAX);
}

// ---- what a user says ----

TEST(Machine, ParametersOfAUserReplaceThreadsAndTheLastCache) {
  const auto made_for = [](const MachineParams& params, const AutoscheduleOptions& options = {}) {
    const driver::ScheduleRequest request = driver::request_for(wide_target, options, params);
    Machine machine = request.machine;
    if (request.options.threads > 0) machine.threads = request.options.threads;
    return machine;
  };
  EXPECT_EQ(made_for(MachineParams::generic()), Machine());
  const Machine small = made_for(MachineParams(3, 1 << 16, 40));
  EXPECT_EQ(small.threads, 3);
  EXPECT_EQ(small.last_cache_bytes(), 1 << 16);
  EXPECT_EQ(small.near_cache_bytes(), 1 << 20) << "they say nothing about nearer caches";
  AutoscheduleOptions options;
  options.threads = 5;
  EXPECT_EQ(made_for(MachineParams(3, 1 << 16, 40), options).threads, 5);
  EXPECT_EQ(made_for(MachineParams(-1, 1 << 16, 40)).threads, planning::reference_threads);
}

// ---- the text form ----

TEST(Machine, RoundTripsAsJson) {
  Machine m = constants();
  m.name = "a \"processor\"";
  m.exp_ns = 1.0 / 3;
  EXPECT_EQ(Machine::from_json(m.to_json(), "here"), m);
}

TEST(Machine, AFileThatIsNoneIsAnError) {
  for (const char* text : {"", "{}", "[1, 2]", "3", "{\"version\": 1, \"name\": 3}"}) {
    expect_error({"a description of a machine is JSON with a number for each figure"},
                 [&] { Machine::from_json(text, "m.json"); });
  }
}

TEST(Machine, WrongFiguresAreRefusedByName) {
  using Json = nlohmann::json;
  const Json good = Json::parse(constants().to_json());
  const auto refused = [&](const char* pointer, const Json& value, const std::string& evidence) {
    Json bad = good;
    bad[Json::json_pointer(pointer)] = value;
    expect_error({"read the machine in \"m.json\"",
                  "a description of a machine is JSON with a number for each figure", evidence,
                  "Make it again"},
                 [&] { Machine::from_json(bad.dump(), "m.json"); });
  };
  refused("/exp_ns", -4, "exp_ns is -4, not a positive number");
  refused("/exp_ns", "4", "exp_ns is \"4\", not a number");
  refused("/load_ns", nullptr, "load_ns is null, not a number");  // what NaN becomes in JSON
  refused("/levels/1/all_threads", 0, "levels[1].all_threads is 0, not a positive number");
  refused("/levels/0/bytes", -1, "levels[0].bytes is -1, not a positive number");
  refused("/levels/2/bytes", 1, "levels[2].bytes is 1, not at least those of the level before");
  refused("/levels/4", good["levels"][3], "4 caches, the last of them memory");
  refused("/levels", 4, "levels is 4, not 4 caches");
  refused("/levels/0", 4, "it has no levels[0].name");
  refused("/threads", 0, "threads is 0, not a positive integer");
  refused("/threads", 2.5, "threads is 2.5, not a positive integer");
  refused("/vector_bytes", -64, "vector_bytes is -64, not a positive integer");
  refused("/registers", 1e12, "registers is ");
  refused("/registers", int64_t{1} << 40, "registers is 1099511627776, not a positive integer");
  refused("/version", 2, "version is 2, not 1");
  Json missing = good;
  missing.erase("page_ns");
  expect_error({"it has no page_ns"}, [&] { Machine::from_json(missing.dump(), "m.json"); });
  std::string infinite = good.dump();
  const size_t at = infinite.find("\"pow_ns\":") + 9;
  infinite.replace(at, infinite.find(',', at) - at, "1e999");
  EXPECT_THROW(Machine::from_json(infinite, "m.json"), CompileError);
}

// ---- files ----

TEST(Machine, TheEnvironmentNamesAFile) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("machine_test_" + std::to_string(::getpid()) + ".json");
  Machine m = constants();
  m.name = "of a file";
  std::ofstream(path) << m.to_json();
  ::setenv("RETROGRADE_MACHINE", path.c_str(), 1);
  EXPECT_EQ(planning::machine_for(wide_target), m);
  std::filesystem::remove(path);
  expect_error({"RETROGRADE_MACHINE names a file with the description of a machine"},
               [&] { planning::machine_for(wide_target); });
  ::unsetenv("RETROGRADE_MACHINE");
}

TEST(Machine, WhatIsKeptIsFoundAgainUnlessItIsBroken) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("machine_cache_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  ::unsetenv("RETROGRADE_MACHINE");
  const char* before = std::getenv("XDG_CACHE_HOME");
  const std::string kept_before = before ? before : "";
  ::setenv("XDG_CACHE_HOME", folder.c_str(), 1);
  EXPECT_EQ(planning::machine_for(wide_target).name, "constants");
  Machine m = constants();
  m.name = "measured";
  const std::string path = tuning::keep_machine(m);
  EXPECT_EQ(planning::machine_for(wide_target), m);
  std::ofstream(path) << "{";
  EXPECT_EQ(planning::machine_for(wide_target).name, "constants");
  std::filesystem::remove_all(folder);
  before ? ::setenv("XDG_CACHE_HOME", kept_before.c_str(), 1) : ::unsetenv("XDG_CACHE_HOME");
}

// ---- GPUs ----

// A change of these figures changes schedules.
TEST(Device, LimitsFollowFromItsFigures) {
  planning::Device device;
  EXPECT_EQ(device.block_threads(), 128);
  EXPECT_EQ(device.enough_threads(), 1 << 15);
  EXPECT_EQ(device.few_threads(), 1 << 12);
  EXPECT_LE(device.block_threads(), device.threads);
  device.multiprocessors *= 2;
  EXPECT_EQ(device.enough_threads(), 1 << 16);
  EXPECT_EQ(device.to_string(),
            "32 multiprocessors of 2048 threads in warps of 32 and 65536 registers, 48 KB of "
            "shared memory for a "
            "block, 2048 KB of L2, 200 GB/s");
}

}  // namespace
}  // namespace retrograde
