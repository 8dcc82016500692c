// The output of explain_kernels, and notes about arrays in local memory.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "jit/ptxas.h"
#include "support/simulated_device.h"

namespace retrograde {
namespace {

class ExplainKernels : public testing::Test {
 protected:
  // A sum of three rows, with a tile in shared memory.
  Func tiled() {
    Func rows("rows"), out("out");
    rows(x, y) = cast<float>(x * y);
    out(x, y) = rows(x, y) + rows(x, y + 1) + rows(x, y + 2);
    out.gpu_tile(x, y, xi, yi, 16, 8);
    rows.compute_at(out, x).gpu_threads(x, y);
    return out;
  }
  // A per-thread table, read at data-dependent indices.
  Func with_table() {
    Func table("table"), out("out");
    table(k) = in(k, 0) * in(k, 1);
    out(x, y) = table(clamp(cast<int>(in(x, y)), 0, 15)) + table(clamp(x, 0, 15));
    out.gpu_tile(x, y, xi, yi, 16, 8);
    table.compute_at(out, xi).bound_extent(k, 16);
    return out;
  }
  ImageParam in{Float(32), 2, "in"};
  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"}, k{"k"};
};

TEST_F(ExplainKernels, NamesThemWithThreadsAndSharedMemory) {
  const Func out = tiled();
  const KernelReport report = explain_kernels(Pipeline(out), with_gpu());
  ASSERT_EQ(report.kernels.size(), 1u);
  const KernelReport::Kernel& kernel = report.kernels[0];
  EXPECT_EQ(kernel.name.find(out.name() + ".kernel"), 0u) << kernel.name;
  EXPECT_EQ(kernel.threads, 16 * 10);
  EXPECT_EQ(kernel.shared_bytes, 16 * 10 * 4);
  EXPECT_EQ(kernel.local_bytes, 0);
  EXPECT_TRUE(report.notes.empty()) << report.notes[0];
  EXPECT_NE(report.to_string().find(kernel.name), std::string::npos) << report.to_string();
}

TEST_F(ExplainKernels, SaysWhichLoopsBecameThem) {
  Func out = tiled();
  RDom r(0, 3, "r");
  out(x, r) += 1.0f;
  out.update().gpu_tile(x, xi, 16, TailStrategy::GuardWithIf);
  const KernelReport report = explain_kernels(Pipeline(out), with_gpu());
  ASSERT_EQ(report.kernels.size(), 2u);
  const std::string name = out.name();
  const std::string rows = report.kernels[0].loops.at(1);
  EXPECT_EQ(report.kernels[0].loops.at(0), name + ": blocks y, x, threads yi, xi");
  EXPECT_EQ(rows.substr(rows.find(':')), ": threads y, x");
  EXPECT_EQ(report.kernels[1].loops,
            std::vector<std::string>{name + ".update(0): blocks x, threads xi"});
  EXPECT_NE(report.to_string().find(report.kernels[1].name + " runs " + name + ".update(0)"),
            std::string::npos)
      << report.to_string();
}

TEST_F(ExplainKernels, IsPartOfWhatExplainsASchedule) {
  const Pipeline pipeline(tiled());
  const KernelReport kernels = explain_kernels(pipeline, with_gpu());
  const ScheduleReport report = pipeline.explain_schedule(with_gpu(), {64, 64});
  EXPECT_EQ(report.kernels.to_json(), kernels.to_json());
  EXPECT_NE(report.to_string().find(kernels.to_string()), std::string::npos) << report.to_string();
  const auto json = nlohmann::json::parse(report.to_json());
  EXPECT_EQ(json["kernels"]["kernels"][0]["name"], kernels.kernels[0].name);
  Func host("host");
  host(x, y) = x + y;
  EXPECT_TRUE(Pipeline(host).explain_schedule(with_gpu(), {64, 64}).kernels.kernels.empty());
}

TEST_F(ExplainKernels, SchedulesOfTheHostHaveNone) {
  Func out("out");
  out(x, y) = x + y;
  const KernelReport report = explain_kernels(Pipeline(out), get_host_target());
  EXPECT_TRUE(report.kernels.empty());
  EXPECT_EQ(report.assembler, "");
  EXPECT_EQ(report.to_string(), "");
}

TEST_F(ExplainKernels, ArraysWithoutRegistersAreAPerformanceNote) {
  const KernelReport report = explain_kernels(Pipeline(with_table()), with_gpu());
  ASSERT_EQ(report.kernels.size(), 1u);
  EXPECT_EQ(report.kernels[0].local_bytes, 64);
  ASSERT_EQ(report.notes.size(), 1u);
  EXPECT_NE(report.notes[0].find(" keeps 64 bytes in local memory"), std::string::npos)
      << report.notes[0];
}

TEST_F(ExplainKernels, WhoListensForWarningsHearsOfThemWhereverCodeComesFrom) {
  Func out = with_table();
  std::vector<std::string> told;
  const WarningScope scope([&](const std::string& text) { told.push_back(text); });
  out.compile_jit(with_gpu());
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].find("performance note: each thread of the kernel \"" + out.name()), 0u)
      << told[0];
  // The same program again: its code comes from the cache.
  Func again = with_table();
  again.compile_jit(with_gpu());
  EXPECT_EQ(told.size(), 2u);
  // Compiled ahead of time.
  out.compile_to_module({in}, "with_table", with_gpu());
  EXPECT_EQ(told.size(), 3u);
}

TEST_F(ExplainKernels, WithoutPtxasItSaysThatFiguresAreMissing) {
  setenv("RETROGRADE_PTXAS", "", 1);
  const KernelReport report = explain_kernels(Pipeline(tiled()), with_gpu());
  unsetenv("RETROGRADE_PTXAS");
  EXPECT_EQ(report.assembler, "no figures of registers: ptxas is not installed");
  EXPECT_FALSE(report.kernels[0].registers.has_value());
  const auto json = nlohmann::json::parse(report.to_json());
  EXPECT_EQ(json["kernels"][0]["name"], report.kernels[0].name);
  EXPECT_EQ(json["kernels"][0]["shared_bytes"], 640);
  EXPECT_TRUE(json["kernels"][0]["registers"].is_null());
}

TEST_F(ExplainKernels, PtxasAddsRegistersStackAndSpills) {
  if (jit::find_ptxas().empty())
    GTEST_SKIP() << "ptxas is not installed: its figures were not looked at";
  const KernelReport report = explain_kernels(Pipeline(with_table()), with_gpu());
  EXPECT_EQ(report.assembler.find("ptxas "), 0u) << report.assembler;
  EXPECT_NE(report.assembler.find(" for sm_80"), std::string::npos) << report.assembler;
  ASSERT_EQ(report.kernels.size(), 1u);
  EXPECT_GT(report.kernels[0].registers, 0);
  EXPECT_GE(report.kernels[0].stack_bytes, 64);
  EXPECT_EQ(report.kernels[0].spill_bytes, 0);
}

}  // namespace
}  // namespace retrograde
