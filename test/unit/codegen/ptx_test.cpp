// PTX of everything that the language can express on a device, for every supported chip. LLVM's
// back end must not abort, ptxas must accept the PTX, and the code must round as the executor does.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "codegen/device/kernel_code.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/operators.h"
#include "support/every_kernel.h"
#include "support/expect_ptxas.h"

namespace retrograde {
namespace {

const char* const chips[] = {"sm_75", "sm_80", "sm_86", "sm_90"};
constexpr Target::Feature capabilities[] = {Target::CUDACapability75, Target::CUDACapability80,
                                            Target::CUDACapability86, Target::CUDACapability90};

codegen::Options options_for(size_t chip) {
  codegen::Options options;
  options.target = get_host_target().with_feature(Target::CUDA).with_feature(capabilities[chip]);
  options.kernels_for_executor = false;
  return options;
}

std::string ptx_of(const ir::LoweredFunction& function, const codegen::Options& options) {
  return codegen::compile_kernels(function, options).ptx;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

size_t count(const std::vector<std::string>& lines, const std::string& what) {
  return static_cast<size_t>(std::ranges::count_if(
      lines, [&](const std::string& line) { return line.find(what) != std::string::npos; }));
}

class Ptx : public testing::TestWithParam<size_t> {};

TEST(PtxOfEverything, NothingOfTheListsIsLeftOut) {
  EXPECT_EQ(every_kernel::left_out(), std::vector<std::string>());
}

std::vector<int> lanes_tried([[maybe_unused]] size_t chip) {
#ifdef RETROGRADE_MANY_PROGRAMS
  return {1, 2, 3, 4, 8, 16};
#else
  return {chip % 2 == 0 ? 1 : 4};
#endif
}

TEST_P(Ptx, OfEverythingIsTakenByPtxas) {
  for (const int lanes : lanes_tried(GetParam())) {
    const auto function = every_kernel::of_everything(lanes, every_kernel::types());
    const std::string ptx = ptx_of(function, options_for(GetParam()));
    EXPECT_GT(count(lines_of(ptx), ".entry"), 80u);
    EXPECT_EQ(count(lines_of(ptx), std::string(".target ") + chips[GetParam()]), 1u);
    expect_ptxas_takes(ptx, chips[GetParam()]);
  }
}

// ptxas may fuse operations that PTX leaves without a rounding mode, and the executor has no
// approximate instructions.
TEST(PtxOfEverything, RoundsEveryFloatAsTheExecutorDoes) {
  const auto function = every_kernel::of_everything(1, every_kernel::types());
  int rounded = 0;
  for (const std::string& line : lines_of(ptx_of(function, options_for(1)))) {
    const std::string instruction = line.substr(0, line.find_first_of(" \t", 1));
    const auto has = [&](const char* part) { return instruction.find(part) != std::string::npos; };
    EXPECT_FALSE(has(".approx") || has(".ftz") || has(".full")) << line;
    const bool is_float = has(".f16") || has(".bf16") || has(".f32") || has(".f64");
    const bool rounds = has("\tadd.") || has("\tsub.") || has("\tmul.") || has("\tfma.") ||
                        has("\tmad.") || has("\tdiv.") || has("\tsqrt.") || has("\trcp.");
    if (!is_float || !rounds) continue;
    EXPECT_TRUE(has(".rn.")) << line;
    ++rounded;
  }
  EXPECT_GT(rounded, 1000);
}

INSTANTIATE_TEST_SUITE_P(Chips, Ptx, testing::Range(size_t{0}, std::size(chips)),
                         [](const auto& chip) { return std::string(chips[chip.param]); });

TEST(PtxOfEverything, WhatOnlyAHostCanDoIsRefused) {
  for (const ir::LoweredFunction& function : every_kernel::of_hosts_alone())
    EXPECT_THROW(ptx_of(function, options_for(1)), Unsupported) << function.name;
}

// ---- FMA ----

// A kernel of x that stores the values side by side.
std::vector<std::string> kernel_of(const std::vector<Expr>& values, bool is_strict = false) {
  std::vector<Stmt> stores;
  for (size_t i = 0; i < values.size(); ++i)
    stores.push_back(ir::make_store("out", values[i], static_cast<int>(i)));
  ir::LoweredFunction function;
  function.name = "f";
  function.args = {{"in", ir::LoweredArgument::Kind::InputBuffer, Float(32), 1, {}},
                   {"out", ir::LoweredArgument::Kind::OutputBuffer, Float(32), 1, {}}};
  function.body = ir::make_launch("k", {1, 1, 1}, {1, 1, 1}, 0, ir::make_block(stores));
  codegen::Options options = options_for(1);
  if (is_strict) options.target = options.target.with_feature(Target::StrictFloat);
  return lines_of(ptx_of(function, options));
}
Expr in(int i) { return ir::make_load(Float(32), "in", i); }

TEST(PtxFma, AProductAndASumAreOne) {
  for (const Expr& value : {in(0) * in(1) + in(2), in(2) + in(0) * in(1), in(0) * in(1) - in(2),
                            in(2) - in(0) * in(1), in(0) * in(1) + in(2) * in(3)}) {
    const auto lines = kernel_of({value});
    EXPECT_EQ(count(lines, "fma.rn.f32"), 1u);
    EXPECT_EQ(count(lines, "add.rn.f32") + count(lines, "sub.rn.f32"), 0u);
  }
}

TEST(PtxFma, AProductFusesWithEachOfItsSums) {
  const Expr product = in(0) * in(1);
  const auto lines = kernel_of({(product + in(2)) * (product - in(3))});
  EXPECT_EQ(count(lines, "fma.rn.f32"), 2u);
  EXPECT_EQ(count(lines, "mul.rn.f32"), 1u) << "that of the sums";
}

TEST(PtxFma, StrictFloatsDoNotFuse) {
  const auto strict = ir::call_op(ir::Op::strict_float, {in(0) * in(1) + in(2)});
  EXPECT_EQ(count(kernel_of({strict}), "fma."), 0u);
  EXPECT_EQ(count(kernel_of({in(0) * in(1) + in(2)}, true), "fma."), 0u);
}

}  // namespace
}  // namespace retrograde
