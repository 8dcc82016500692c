// NVIDIA's assembler: its report on kernels, and its machine code in the compile cache. Where it is
// not installed, a stub that only counts its runs replaces it, and tests of the real one are
// skipped.
#include "jit/ptxas.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>

#include "codegen/device/kernel_code.h"
#include "frontend/run/compile_cache.h"
#include "jit/kernel_images.h"
#include "support/temporary_folder.h"

namespace retrograde::jit {
namespace {

constexpr const char* scaling = R"(.version 7.8
.target sm_75
.address_size 64
.visible .entry kernel_scale(.param .u64 data)
{
  .local .align 4 .b8 __local_depot0[64];
  .reg .b64 %rd<3>;
  .reg .f32 %f<3>;
  ld.param.u64 %rd1, [data];
  cvta.to.global.u64 %rd2, %rd1;
  ld.global.f32 %f1, [%rd2];
  mul.f32 %f2, %f1, 0f40000000;
  st.global.f32 [%rd2], %f2;
  ret;
}
)";

// Sets an environment variable, and restores it when the test ends.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ~Variable() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* const name_;
  std::optional<std::string> before_;
};

TEST(Ptxas, FiguresAreThoseOfTheKernelNamedBefore) {
  const auto figures = figures_in(
      "ptxas info    : 0 bytes gmem\n"
      "ptxas info    : Compiling entry function 'a' for 'sm_80'\n"
      "ptxas info    : Function properties for a\n"
      "    0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads\n"
      "ptxas info    : Used 12 registers, used 0 barriers, 380 bytes cmem[0]\n"
      "ptxas info    : Compiling entry function 'b' for 'sm_80'\n"
      "ptxas info    : Function properties for b\n"
      "    64 bytes stack frame, 8 bytes spill stores, 16 bytes spill loads\n"
      "ptxas info    : Used 255 registers, used 1 barriers, 96 bytes cumulative stack size\n");
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_EQ(figures.at("a").registers, 12);
  EXPECT_EQ(figures.at("a").stack_bytes, 0);
  EXPECT_EQ(figures.at("b").registers, 255);
  EXPECT_EQ(figures.at("b").stack_bytes, 96) << "with what it calls";
  EXPECT_EQ(figures.at("b").spill_store_bytes, 8);
  EXPECT_EQ(figures.at("b").spill_load_bytes, 16);
}

TEST(Ptxas, ArraysInLocalMemoryAreThoseOfAKernelAndOfWhatItCalls) {
  const auto bytes = codegen::local_bytes_by_kernel(
      ".visible .entry plain(\n\t.param .u64 plain_param_0\n)\n{\n\tret;\n}\n"
      ".func  (.param .b32 func_retval0) reduced(\n\t.param .b32 reduced_param_0\n)\n{\n"
      "\t.local .align 4 .b8 \t__local_depot1[28];\n\tret;\n}\n"
      ".visible .entry own(\n\t.param .u64 own_param_0\n)\n.maxntid 16, 8, 1\n{\n"
      "\t.local .align 16 .b8 \t__local_depot2[64];\n\tret;\n}\n"
      ".visible .entry calling(\n)\n{\n\t.local .align 16 .b8 \t__local_depot3[4];\n"
      "\tcall.uni (retval0), \n\treduced, \n\t(\n\tparam0\n\t);\n\tret;\n}\n");
  EXPECT_EQ(bytes, (std::map<std::string, int64_t>{{"own", 64}, {"calling", 32}}));
}

TEST(Ptxas, AnAssemblerThatIsNamedIsTheOneOrThereIsNone) {
  const Variable named("RETROGRADE_PTXAS", "/nowhere/ptxas");
  EXPECT_EQ(find_ptxas(), "");
  const Variable folder("RETROGRADE_PTXAS", "/");
  EXPECT_EQ(find_ptxas(), "") << "a folder is no program";
  const Variable nothing("RETROGRADE_PTXAS", "");
  EXPECT_EQ(find_ptxas(), "");
}

TEST(Ptxas, AProgramThatFailsIsAProblemAndNotAnError) {
  EXPECT_NE(assemble("/nowhere/ptxas", scaling, 80).problem, "");
  EXPECT_EQ(ptxas_version("/nowhere/ptxas"), "");
  EXPECT_EQ(assemble("/bin/true", scaling, 80).problem, "it wrote no machine code");
}

// ---- the real one ----

class RealPtxas : public testing::Test {
 protected:
  void SetUp() override {
    if (program.empty()) GTEST_SKIP() << "ptxas is not installed: its figures were not looked at";
  }
  const std::string program = find_ptxas();
};

TEST_F(RealPtxas, TellsWhatAKernelTakes) {
  EXPECT_NE(ptxas_version(program), "");
  for (const int capability : {50, 75, 80, 86, 90}) {
    const Assembly made = assemble(program, scaling, capability);
    ASSERT_EQ(made.problem, "");
    EXPECT_EQ(made.image.substr(0, 4),
              "\x7f"
              "ELF");
    ASSERT_EQ(made.kernels.count("kernel_scale"), 1u);
    EXPECT_GT(made.kernels.at("kernel_scale").registers, 0);
  }
}

TEST_F(RealPtxas, WhatItRefusesIsToldInItsWords) {
  const Assembly made = assemble(program, ".version 7.8\n.target sm_75\nnonsense\n", 80);
  EXPECT_TRUE(made.image.empty());
  EXPECT_NE(made.problem.find("nonsense"), std::string::npos) << made.problem;
}

// ---- the cache ----

class KernelImages : public testing::Test {
 protected:
  KernelImages() {
    // Its last argument but one is the output file for the machine code.
    std::ofstream(program) << "#!/bin/sh\necho run >> " << runs
                           << "\nwhile [ $# -gt 2 ]; do shift; done\necho code > \"$1\"\n";
    chmod(program.c_str(), 0700);
  }
  ~KernelImages() override { set_compile_cache_directory(""); }
  size_t times_run() const {
    std::ifstream in(runs);
    return static_cast<size_t>(std::count(std::istreambuf_iterator<char>(in), {}, '\n'));
  }
  TemporaryFolder root;
  const std::string program = (root.path() / "ptxas").string(),
                    runs = (root.path() / "runs").string();
  const Variable named{"RETROGRADE_PTXAS", program};
};

TEST_F(KernelImages, AreAssembledOnceForEachTextChipAndDriver) {
  set_compile_cache_directory((root.path() / "cache").string());
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(kernel_image("text", 80, 12000), "code\n");
    EXPECT_EQ(times_run(), 1u);
  }
  EXPECT_EQ(kernel_image("other", 80, 12000), "code\n");
  EXPECT_EQ(kernel_image("text", 90, 12000), "code\n");
  EXPECT_EQ(kernel_image("text", 80, 13000), "code\n");
  EXPECT_EQ(times_run(), 4u);
  // A later run of the program.
  set_compile_cache_directory((root.path() / "cache").string());
  EXPECT_EQ(kernel_image("text", 80, 12000), "code\n");
  EXPECT_EQ(times_run(), 4u);
}

TEST_F(KernelImages, AreThereWithoutTheAssemblerOnceTheyAreKept) {
  set_compile_cache_directory((root.path() / "cache").string());
  EXPECT_EQ(kernel_image("text", 80, 12000), "code\n");
  const Variable none("RETROGRADE_PTXAS", "");
  EXPECT_EQ(kernel_image("text", 80, 12000), "code\n");
  EXPECT_EQ(kernel_image("other", 80, 12000), std::nullopt);
}

TEST_F(KernelImages, AreNotMadeWithoutACache) {
  EXPECT_EQ(kernel_image("text", 80, 12000), std::nullopt);
  EXPECT_EQ(times_run(), 0u);
}

}  // namespace
}  // namespace retrograde::jit
