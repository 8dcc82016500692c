// Schedules that no GPU can run are rejected during lowering, in terms of the user's program.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include "support/errors.h"

namespace retrograde {
namespace {

class GpuRules : public testing::Test {
 protected:
  Var x{"x"}, y{"y"}, z{"z"}, w{"w"}, xi{"xi"}, yi{"yi"}, xo{"xo"};
  ImageParam in{Float(32), 2, "in"};
  Func f{"f"}, out{"out"};
  const Target gpu = get_host_target().with_feature(Target::CUDA);

  void SetUp() override {
    f(x, y) = in(x, y) + 1.0f;
    out(x, y) = f(x, y) * 2.0f;
  }
  void lower(Func func) { func.compile_to_module({in}, "out", gpu); }
  void refuses(std::initializer_list<std::string_view> parts, Func func) {
    expect_error<UserError>(parts, [&] { lower(func); });
  }
};

TEST_F(GpuRules, ATargetHasAGpu) {
  out.gpu_tile(x, y, xi, yi, 8, 8);
  expect_error<UserError>({"\"out", "the target has a GPU", "Target::CUDA"},
                          [&] { out.compile_to_module({in}, "out", get_host_target()); });
}

TEST_F(GpuRules, BlocksAreAroundThreads) {
  out.gpu_threads(y).gpu_blocks(x);
  refuses({"GPU threads", "\"y\"", "blocks consist of threads", "\"x\"", "Reorder"}, out);
}

TEST_F(GpuRules, ThreadsBelongToBlocks) {
  out.gpu_threads(x);
  refuses({"GPU threads", "\"x\"", "threads belong to blocks", "gpu_blocks"}, out);
}

TEST_F(GpuRules, ABlockHasAtMost1024Threads) {
  out.gpu_tile(x, y, xi, yi, 64, 32);
  refuses({"at most 1024 threads", "2048", "smaller factors"}, out);
}

TEST_F(GpuRules, GridsAndBlocksHaveThreeDimensions) {
  Func g("g");
  g(x, y, z, w) = x + y + z + w;
  g.gpu_blocks(x, y, z).gpu_blocks(w);
  expect_error<UserError>({"at most three dimensions", "4 loops over blocks"},
                          [&] { g.compile_to_module({}, "g", gpu); });
  Func h("h");
  Var b("b");
  h(b, x, y, z, w) = x + y + z + w;
  h.reorder(x, y, z, w, b).bound(x, 0, 2).bound(y, 0, 2).bound(z, 0, 2).bound(w, 0, 2);
  h.gpu_blocks(b).gpu_threads(x, y, z).gpu_threads(w);
  expect_error<UserError>({"at most three dimensions", "4 loops over threads"},
                          [&] { h.compile_to_module({}, "h", gpu); });
}

TEST_F(GpuRules, SharedMemoryHasALimit) {
  out.split(x, xo, xi, 128).split(y, y, yi, 64).reorder(xi, yi, xo, y);
  out.gpu_blocks(xo, y).gpu_threads(xi);
  f.compute_at(out, xo).gpu_threads(x).bound_extent(x, 128).bound_extent(y, 200);
  f.store_in(MemoryType::GPUShared);
  refuses({"\"f", "shared memory", "as many bytes of it as the target says", "102400 bytes",
           "65536", "Heap"},
          out);
}

TEST_F(GpuRules, NumbersOfThreadsDoNotDependOnData) {
  ImageParam counts(Int(32), 1, "counts");
  Func g("g");
  RDom r(0, 16, "r");
  r.where(r < counts(x));
  g(x) = 0;
  g(x) += r;
  g.update().gpu_blocks(x).allow_race_conditions().gpu_threads(r);
  // The check is no stricter than necessary: the domain is constant, although the condition is not.
  EXPECT_NO_THROW(g.compile_to_module({counts}, "g", gpu));
}

TEST_F(GpuRules, ThreadsReadTheirOwnRegistersAlone) {
  Func g("g");
  g(x, y) = f(x, y) + f(x + 1, y);
  g.gpu_tile(x, y, xi, yi, 16, 8);
  f.compute_at(g, x).store_in(MemoryType::Register).gpu_threads(x, y);
  refuses({"\"f", "registers", "what it stored itself", "GPUShared"}, g);
}

TEST_F(GpuRules, LanesAreInnermostAndAtMost32) {
  out.split(x, xo, xi, 64).gpu_blocks(xo, y).gpu_lanes(xi);
  refuses({"a warp has 32 lanes", "64"}, out);
}

TEST_F(GpuRules, NothingIsComputedBetweenLoopsOverThreads) {
  out.gpu_tile(x, y, xi, yi, 16, 8);
  f.compute_at(out, yi);
  refuses({"\"f", "between loops over threads"}, out);
}

TEST_F(GpuRules, NothingIsComputedBetweenLoopsOverBlocks) {
  out.gpu_tile(x, y, xi, yi, 16, 8);
  f.compute_at(out, y);
  refuses({"between loops over blocks", "\"f"}, out);
}

TEST_F(GpuRules, KernelsAreNotLaunchedByParallelLoops) {
  out.split(x, xo, xi, 32).reorder(xi, xo, y).parallel(y).gpu_blocks(xo).gpu_threads(xi);
  expect_error<Unsupported>({"launched by one thread", "parallel"}, [&] { lower(out); });
}

TEST_F(GpuRules, OtherDevicesAreUnsupported) {
  expect_error<Unsupported>({"generated for CUDA"}, [&] { out.gpu_blocks(x, DeviceAPI::OpenCL); });
  expect_error<Unsupported>({"Hexagon"}, [&] { out.hexagon(x); });
  expect_error<UserError>({"a directive for GPUs names a GPU", "names the host"},
                          [&] { out.gpu_blocks(x, DeviceAPI::Host); });
}

TEST_F(GpuRules, NoVectorHasThreads) {
  out.split(x, xo, xi, 4).gpu_blocks(y).gpu_threads(xi).vectorize(xo);
  out.reorder(xi, xo, y);
  refuses({"vectorize", "threads compute vectors, and no vector has threads", "Reorder"}, out);
}

TEST_F(GpuRules, KernelsCallNothingOfTheHost) {
  Func g("g");
  g(x, y) = print(in(x, y));
  g.gpu_tile(x, y, xi, yi, 8, 8);
  expect_error<Unsupported>({"a kernel cannot call functions of the host", "print"},
                            [&] { lower(g); });
  Func words("words");
  words(x, y) = Expr(std::string("word"));
  words.gpu_tile(x, y, xi, yi, 8, 8);
  expect_error<Unsupported>({"a kernel cannot call", "the address of the text \"word\""},
                            [&] { lower(words); });
}

TEST_F(GpuRules, ReductionsRaceOnGpusAsElsewhere) {
  Func g("g");
  RDom r(0, 16, "r");
  g(x) = 0;
  g(x) += r;
  expect_error<UserError>({"GPU threads", "must not touch the same element", "atomic()"},
                          [&] { g.update().gpu_threads(r); });
}

}  // namespace
}  // namespace retrograde
