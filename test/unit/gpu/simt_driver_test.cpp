// The simulated driver: profiles, streams, capture, failures.
#include <algorithm>

#include "support/simt_testing.h"

namespace {

using namespace simt_testing;

// ---- the profile ----

void copy_with_stride(Thread* t, int32_t* data, int32_t n) {
  store(t, data + n / 2 + t->thread[0], load(t, data + t->thread[0] * 4, 0), 1);
}

TEST_F(Simt, CountsSectorsOfWarps) {
  options.change([](auto& o) { o.profile = 1; });
  retrograde_simt_reset_profile();
  ASSERT_EQ(run<copy_with_stride>(false, {1, 1, 64, 1, 0}, 512), success);
  retrograde_simt_profile p;
  ASSERT_TRUE(retrograde_simt_get_profile("kernel", &p));
  EXPECT_EQ(p.launches, 1);
  EXPECT_EQ(p.blocks, 1);
  EXPECT_EQ(p.threads, 64);
  EXPECT_EQ(p.global_requests, 4) << "two statements of two warps";
  EXPECT_EQ(p.global_bytes, 64 * 8);
  EXPECT_EQ(p.load_sectors, 32) << "two values in each";
  EXPECT_EQ(p.store_sectors, 8);
  EXPECT_EQ(p.ideal_sectors, 16);
  EXPECT_FALSE(retrograde_simt_get_profile("other", &p));
}

TEST_F(Simt, CountsBankConflictsAndBarriers) {
  options.change([](auto& o) { o.profile = 1; });
  const auto profile_of = [&](const Image& image, auto run) {
    retrograde_simt_reset_profile();
    run(function_of(image, "transpose"));
    EXPECT_EQ(cuStreamSynchronize(stream), success);
    retrograde_simt_profile p;
    EXPECT_TRUE(retrograde_simt_get_profile(nullptr, &p));
    return p;
  };
  const Address in = allocate(1 << 14), out = allocate(1 << 14);
  const Image padded{transpose_kernel<33>()}, dense{transpose_kernel<32>()};
  const auto good =
      profile_of(padded, [&](Function f) { transpose_image<33, true>(f, in, out, 64, stream); });
  EXPECT_EQ(good.bank_conflicts, 0);
  EXPECT_EQ(good.barriers, 4);
  EXPECT_EQ(good.global_sectors, good.ideal_sectors);
  EXPECT_EQ(good.shared_requests, 2 * 4 * 32);
  const auto bad =
      profile_of(dense, [&](Function f) { transpose_image<32, true>(f, in, out, 64, stream); });
  EXPECT_EQ(bad.bank_conflicts, 4 * 32 * 31) << "each column is in one bank";
}

// ---- streams ----

void store_number(Thread* t, int32_t* data, int32_t n) {
  const int32_t at = load(t, data, 0);
  store(t, data, at + 1, 1);
  store(t, data + 1 + at, n, 2);
}

// The order in which work submitted alternately to two streams has run.
std::vector<int32_t> order_of_two(Function f, Address data, Stream a, Stream b) {
  for (int32_t i = 0; i < 8; i++) {
    int32_t n = i;
    void* args[] = {&data, &n};
    EXPECT_EQ(cuLaunchKernel(f, 1, 1, 1, 1, 1, 1, 0, i % 2 ? b : a, args, nullptr), success);
  }
  EXPECT_EQ(cuCtxSynchronize(), success);
  std::vector<int32_t> all(9);
  EXPECT_EQ(cuMemcpyDtoHAsync_v2(all.data(), data, 36, a), success);
  return {all.begin() + 1, all.end()};
}

TEST_F(Simt, StreamsOvertakeOneAnother) {
  const Image image{array_kernel<store_number>("kernel", false)};
  const Function f = function_of(image, "kernel");
  Stream other = nullptr;
  ASSERT_EQ(cuStreamCreate(&other, 1), success);
  bool overtaken = false;
  for (int i = 0; i < 10; i++) {
    const Address data = upload(std::vector<int32_t>(9));
    ASSERT_EQ(cuStreamSynchronize(stream), success);
    const auto order = order_of_two(f, data, stream, other);
    std::vector<int32_t> even, odd;
    for (const int32_t n : order) (n % 2 ? odd : even).push_back(n);
    EXPECT_TRUE(std::is_sorted(even.begin(), even.end()));
    EXPECT_TRUE(std::is_sorted(odd.begin(), odd.end()));
    overtaken = overtaken || !std::is_sorted(order.begin(), order.end());
  }
  EXPECT_TRUE(overtaken);
  options.change([](auto& o) { o.in_order = 1; });
  const Address data = upload(std::vector<int32_t>(9));
  ASSERT_EQ(cuStreamSynchronize(stream), success);
  const auto order = order_of_two(f, data, stream, other);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

TEST_F(Simt, WorkRunsWhenSomebodyWaits) {
  const Image image{array_kernel<add_by_all>("kernel", false)};
  Address data = upload(std::vector<int32_t>(4));
  int32_t n = 4;
  ASSERT_EQ(launch(function_of(image, "kernel"), {1, 1, 8, 1, 0}, {&data, &n}), success);
  EXPECT_GE(live_objects().pending, 1);
  EXPECT_EQ(cuStreamQuery(stream), not_ready);
  ASSERT_EQ(cuStreamSynchronize(stream), success);
  EXPECT_EQ(live_objects().pending, 0);
  EXPECT_EQ(cuStreamQuery(stream), success);
}

TEST_F(Simt, EventsOrderStreams) {
  const Image image{array_kernel<store_number>("kernel", false)};
  const Function f = function_of(image, "kernel");
  Stream other = nullptr;
  Event event = nullptr;
  ASSERT_EQ(cuStreamCreate(&other, 1), success);
  ASSERT_EQ(cuEventCreate(&event, 0), success);
  for (int i = 0; i < 10; i++) {
    Address data = upload(std::vector<int32_t>(9));
    int32_t n = 1;
    ASSERT_EQ(launch(f, {1, 1, 1, 1, 0}, {&data, &n}), success);
    ASSERT_EQ(cuEventRecord(event, stream), success);
    ASSERT_EQ(cuStreamWaitEvent(other, event, 0), success);
    n = 2;
    void* args[] = {&data, &n};
    ASSERT_EQ(cuLaunchKernel(f, 1, 1, 1, 1, 1, 1, 0, other, args, nullptr), success);
    ASSERT_EQ(cuStreamSynchronize(other), success);
    EXPECT_EQ(download<int32_t>(data, 3), (std::vector<int32_t>{2, 1, 2}));
  }
  EXPECT_EQ(cuEventSynchronize(event), success);
  EXPECT_EQ(cuEventDestroy_v2(event), success);
}

TEST_F(Simt, LockedMemoryIsReadWhenTheCopyRuns) {
  std::vector<int32_t> pageable = {1}, locked = {1};
  ASSERT_EQ(cuMemHostRegister_v2(locked.data(), 4, 0), success);
  const Address a = upload(pageable), b = upload(locked);
  pageable[0] = locked[0] = 2;
  EXPECT_EQ(download<int32_t>(a, 1)[0], 1);
  EXPECT_EQ(download<int32_t>(b, 1)[0], 2);
  ASSERT_EQ(cuMemHostUnregister(locked.data()), success);
}

// ---- capture ----

TEST_F(Simt, GraphsRunWhenTheyAreLaunched) {
  const Image image{array_kernel<add_by_all>("kernel", false)};
  const Function f = function_of(image, "kernel");
  Address data = upload(std::vector<int32_t>(4));
  int32_t n = 4;
  Graph graph = nullptr;
  GraphExec exec = nullptr;
  ASSERT_EQ(cuStreamBeginCapture_v2(stream, 0), success);
  ASSERT_EQ(launch(f, {1, 1, 8, 1, 0}, {&data, &n}), success);
  ASSERT_EQ(cuStreamEndCapture(stream, &graph), success);
  ASSERT_EQ(cuGraphInstantiateWithFlags(&exec, graph, 0), success);
  EXPECT_EQ(download<int32_t>(data, 1)[0], 0);
  for (int i = 0; i < 3; i++) ASSERT_EQ(cuGraphLaunch(exec, stream), success);
  EXPECT_EQ(download<int32_t>(data, 1)[0], 24);
  EXPECT_EQ(cuGraphExecDestroy(exec), success);
  EXPECT_EQ(cuGraphDestroy(graph), success);
}

TEST_F(Simt, CaptureRefusesWhatItCannotRecord) {
  const Image image{saxpy_kernel()};
  const Address data = allocate(16);
  std::vector<int32_t> host(4);
  Module module = nullptr;
  Address more = 0;
  const auto refused = [&](auto call) {
    ASSERT_EQ(cuStreamBeginCapture_v2(stream, 0), success);
    const Result result = call();
    EXPECT_TRUE(result == capture_unsupported || result == capture_implicit) << result;
    Graph graph = nullptr;
    EXPECT_EQ(cuStreamEndCapture(stream, &graph), capture_invalidated);
    EXPECT_EQ(graph, nullptr);
  };
  refused([&] { return cuMemAlloc_v2(&more, 16); });
  refused([&] { return cuMemFree_v2(data); });
  refused([&] { return cuStreamSynchronize(stream); });
  refused([&] { return cuCtxSynchronize(); });
  refused([&] { return cuModuleLoadDataEx(&module, image.source(), 0, nullptr, nullptr); });
  refused([&] { return cuMemcpyDtoHAsync_v2(host.data(), data, 16, stream); });
  refused([&] { return cuMemcpyHtoDAsync_v2(data, host.data(), 16, stream); });
  refused([&] { return cuMemcpyDtoDAsync_v2(data, data, 16, nullptr); });
}

TEST_F(Simt, ARelaxedThreadMayAllocateDuringACapture) {
  Graph graph = nullptr;
  Address memory = 0;
  int mode = capture_mode_relaxed;
  ASSERT_EQ(cuStreamBeginCapture_v2(stream, capture_mode_global), success);
  ASSERT_EQ(cuThreadExchangeStreamCaptureMode(&mode), success);
  EXPECT_EQ(mode, capture_mode_global);
  EXPECT_EQ(cuMemAlloc_v2(&memory, 16), success);
  ASSERT_EQ(cuThreadExchangeStreamCaptureMode(&mode), success);
  EXPECT_EQ(mode, capture_mode_relaxed);
  EXPECT_EQ(cuStreamEndCapture(stream, &graph), success);
  EXPECT_EQ(cuGraphDestroy(graph), success);
  EXPECT_EQ(cuMemFree_v2(memory), success);
  mode = 3;
  EXPECT_EQ(cuThreadExchangeStreamCaptureMode(&mode), invalid_value);
}

// ---- the driver's checks ----

TEST_F(Simt, ChecksCalls) {
  const Image image{saxpy_kernel()};
  const Function f = function_of(image, "saxpy");
  Address x = allocate(16), y = allocate(16), none = 0;
  float a = 1;
  int32_t n = 4;
  const std::vector<void*> args = {&x, &y, &a, &n};
  EXPECT_EQ(launch(f, {0, 1, 32, 1, 0}, args), invalid_value);
  EXPECT_EQ(launch(f, {1, 1, 1025, 1, 0}, args), invalid_value);
  EXPECT_EQ(launch(f, {1, 1, 64, 17, 0}, args), invalid_value);
  EXPECT_EQ(launch(f, {1, 1, 32, 1, 49153}, args), invalid_value);
  ASSERT_EQ(cuFuncSetAttribute(f, function_max_shared_bytes, 65536), success);
  EXPECT_EQ(launch(f, {1, 1, 32, 1, 49153}, args), success);
  EXPECT_EQ(cuFuncSetAttribute(f, function_max_shared_bytes, 1 << 20), invalid_value);
  EXPECT_EQ(cuMemFree_v2(x + 4), invalid_value);
  EXPECT_EQ(cuMemcpyDtoDAsync_v2(x, y, 17, stream), invalid_value);
  EXPECT_EQ(cuMemAlloc_v2(&none, size_t{1} << 40), out_of_memory);
  char log[200] = "";
  int options_of[] = {jit_error_log, jit_error_log_bytes};
  void* values[] = {log, reinterpret_cast<void*>(sizeof log)};
  Module module = nullptr;
  EXPECT_EQ(cuModuleLoadDataEx(&module, ".version 7.8", 2, options_of, values), invalid_image);
  EXPECT_NE(std::string(log).find("simulated device"), std::string::npos);
  Function function = nullptr;
  ASSERT_EQ(cuModuleLoadDataEx(&module, image.source(), 0, nullptr, nullptr), success);
  EXPECT_EQ(cuModuleGetFunction(&function, module, "none"), not_found);
}

TEST_F(Simt, CallsFailWhenToldTo) {
  Address address = 0;
  const int64_t before = retrograde_simt_call_count("cuMemAlloc_v2");
  retrograde_simt_fail_call("cuMemAlloc_v2", 2, out_of_memory);
  ASSERT_EQ(cuMemAlloc_v2(&address, 16), success);
  EXPECT_EQ(cuMemAlloc_v2(&address, 16), out_of_memory);
  EXPECT_EQ(cuMemAlloc_v2(&address, 16), success);
  EXPECT_EQ(retrograde_simt_call_count("cuMemAlloc_v2"), before + 3);
  retrograde_simt_fail_call(nullptr, 1, unknown_error);
  EXPECT_EQ(cuStreamSynchronize(stream), unknown_error);
  retrograde_simt_fail_call("cuMemAlloc_v2", 9, out_of_memory);
  EXPECT_EQ(retrograde_simt_call_off(), 1);
}

TEST_F(Simt, ALostDeviceFailsUntilItsContextIsMadeAnew) {
  retrograde_simt_lose_device(0);
  Address address = 0;
  EXPECT_EQ(cuMemAlloc_v2(&address, 16), launch_failed);
  ASSERT_EQ(cuCtxDestroy_v2(context), success);
  ASSERT_EQ(cuCtxCreate_v2(&context, 0, 0), success);
  EXPECT_EQ(cuMemAlloc_v2(&address, 16), success);
}

}  // namespace
