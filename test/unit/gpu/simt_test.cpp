// Kernels on the simulated device: thread orders, and the errors that it detects.
#include <algorithm>
#include <numeric>

#include "support/simt_testing.h"

namespace {

using namespace simt_testing;

// ---- results, in every order ----

TEST_F(Simt, RunsPlainKernels) {
  const Image image{saxpy_kernel()};
  const Function f = function_of(image, "saxpy");
  for (const int32_t order : orders) {
    options.change([&](auto& o) { o.order = order; });
    int32_t n = 1000;
    std::vector<float> x(1000), y(1000, 1.0f);
    std::iota(x.begin(), x.end(), 0.0f);
    Address on_x = upload(x), on_y = upload(y);
    float a = 2.0f;
    ASSERT_EQ(launch(f, {8, 1, 128, 1, 0}, {&on_x, &on_y, &a, &n}), success);
    const std::vector<float> result = download<float>(on_y, 1000);
    for (size_t i = 0; i < 1000; i++)
      ASSERT_EQ(result[i], 2.0f * static_cast<float>(i) + 1.0f) << i;
  }
}

TEST_F(Simt, RunsKernelsWithBarriers) {
  const Image image{transpose_kernel()};
  const Function f = function_of(image, "transpose");
  for (const int32_t order : orders) {
    options.change([&](auto& o) { o.order = order; });
    std::vector<float> in(64 * 64);
    std::iota(in.begin(), in.end(), 0.0f);
    const Address out = allocate(in.size() * sizeof(float));
    transpose_image<33, true>(f, upload(in), out, 64, stream);
    const std::vector<float> result = download<float>(out, in.size());
    for (size_t y = 0; y < 64; y++)
      for (size_t x = 0; x < 64; x++) ASSERT_EQ(result[x * 64 + y], in[y * 64 + x]);
  }
}

void sum_by_shuffles(Thread* t, int32_t* data, int32_t) {
  uint32_t sum = static_cast<uint32_t>(global_x(t));
  for (int32_t step = 16; step > 0; step /= 2) sum += shuffle(t, sum, step, retrograde_simt_xor, 0);
  const uint32_t above =
      shuffle(t, sum + static_cast<uint32_t>(t->thread[0]), 1, retrograde_simt_down, 1);
  const uint32_t below = shuffle(t, static_cast<uint32_t>(t->thread[0]), 1, retrograde_simt_up, 1);
  const uint32_t third =
      shuffle(t, static_cast<uint32_t>(t->thread[0]), 3, retrograde_simt_index, 2);
  store(t, data + global_x(t) * 4, static_cast<int32_t>(sum), 2);
  store(t, data + global_x(t) * 4 + 1, static_cast<int32_t>(above), 2);
  store(t, data + global_x(t) * 4 + 2, static_cast<int32_t>(below), 2);
  store(t, data + global_x(t) * 4 + 3, static_cast<int32_t>(third), 2);
}

TEST_F(Simt, ShufflesExchangeValuesOfAWarp) {
  for (const int32_t order : orders) {
    options.change([&](auto& o) { o.order = order; });
    ASSERT_EQ(run<sum_by_shuffles>(true, {1, 1, 64, 1, 0}, 256), success);
    for (int32_t i = 0; i < 64; i++) {
      const int32_t warp = i / 32, lane = i % 32, sum = warp == 0 ? 496 : 1520;
      const int32_t above = lane == 31 ? i : i + 1, below = lane == 0 ? i : i - 1;
      const auto at = static_cast<size_t>(i) * 4;
      EXPECT_EQ(left[at], sum);
      EXPECT_EQ(left[at + 1], sum + above);
      EXPECT_EQ(left[at + 2], below);
      EXPECT_EQ(left[at + 3], warp * 32 + 3);
    }
  }
}

void order_of_threads(Thread* t, int32_t* data, int32_t n) {
  add_atomically(t, data + n - 1, 1, 0);
  store(t, data + t->thread[0], data[n - 1], 1);
}

TEST_F(Simt, ThreadsRunInTheOrderOfChoice) {
  ASSERT_EQ(run<order_of_threads>(false, {1, 1, 64, 1, 0}, 65), success);
  EXPECT_EQ(left[0], 1);
  EXPECT_EQ(left[63], 64);
  options.change([](auto& o) { o.order = retrograde_simt_reverse; });
  ASSERT_EQ(run<order_of_threads>(false, {1, 1, 64, 1, 0}, 65), success);
  EXPECT_EQ(left[0], 64);
  options.change([](auto& o) { o.order = retrograde_simt_random; });
  ASSERT_EQ(run<order_of_threads>(false, {1, 1, 64, 1, 0}, 65), success);
  const auto first = left;
  EXPECT_FALSE(std::is_sorted(first.begin(), first.begin() + 64));
  ASSERT_EQ(run<order_of_threads>(false, {1, 1, 64, 1, 0}, 65), success);
  EXPECT_EQ(left, first) << "the same seed, the same order";
  options.change([](auto& o) { o.seed = 77; });
  ASSERT_EQ(run<order_of_threads>(false, {1, 1, 64, 1, 0}, 65), success);
  EXPECT_NE(left, first);
}

void read_shared(Thread* t, int32_t* data, int32_t) {
  auto* shared = reinterpret_cast<int32_t*>(t->shared);
  store(t, data + global_x(t), load(t, shared + t->thread[0], 0, retrograde_simt_shared), 1);
  store(t, shared + t->thread[0], 5, 2, retrograde_simt_shared);
}

TEST_F(Simt, SharedMemoryStartsPoisonedInEachBlock) {
  ASSERT_EQ(run<read_shared>(false, {2, 1, 4, 1, 16}, 8), success);
  for (const int32_t value : left) EXPECT_EQ(value, -1);
}

// ---- races ----

TEST_F(Simt, FindsAMissingBarrierInEveryOrder) {
  for (const int32_t order : orders) {
    options.change([&](auto& o) { o.order = order; });
    const Image image{transpose_kernel<33, false>()};
    transpose_image<33, false>(function_of(image, "transpose"), allocate(1 << 14),
                               allocate(1 << 14), 64, stream);
    EXPECT_EQ(cuStreamSynchronize(stream), launch_failed);
    const std::string text = retrograde_simt_last_finding();
    EXPECT_NE(text.find("kernel transpose"), std::string::npos) << text;
    EXPECT_NE(text.find("of shared memory"), std::string::npos) << text;
    EXPECT_NE(text.find("\"tile(x, y) = in(x, y)\""), std::string::npos) << text;
    EXPECT_NE(text.find("\"tile(y, x)\""), std::string::npos) << text;
    TearDown();
    SetUp();
  }
}

void store_by_two(Thread* t, int32_t* data, int32_t) {
  store(t, data + t->thread[0] / 2, t->thread[0], 1);
}
void store_the_same(Thread* t, int32_t* data, int32_t) { store(t, data + t->thread[0] / 2, 7, 1); }
struct Pair {
  int32_t first, second;
};
void store_in_part_the_same(Thread* t, int32_t* data, int32_t) {
  store(t, reinterpret_cast<Pair*>(data + t->thread[0]), {7, 7}, 1);
}
void store_in_part_others(Thread* t, int32_t* data, int32_t) {
  store(t, reinterpret_cast<Pair*>(data + t->thread[0]), {t->thread[0], 7}, 1);
}
void store_by_blocks(Thread* t, int32_t* data, int32_t) { store(t, data, t->block[0], 1); }
void read_and_store_by_blocks(Thread* t, int32_t* data, int32_t) {
  if (t->block[0] == 1) store(t, data, 3, 1);
  load(t, data, 0);
}
void add_and_store(Thread* t, int32_t* data, int32_t) {
  add_atomically(t, data, 1, 0);
  if (t->thread[0] == 5) store(t, data, 1, 1);
}
void store_bytes(Thread* t, int32_t* data, int32_t) {
  auto* bytes = reinterpret_cast<uint8_t*>(data);
  store(t, bytes + t->thread[0], static_cast<uint8_t>(t->thread[0]), 0);
}
void store_bytes_and_words(Thread* t, int32_t* data, int32_t) {
  auto* bytes = reinterpret_cast<uint8_t*>(data);
  if (t->thread[0] < 4) store(t, bytes + t->thread[0], uint8_t{1}, 0);
  if (t->thread[0] == 4) load(t, data, 1);
}

TEST_F(Simt, FindsTwoStoresOfDifferentValues) {
  expect_finding<store_by_two>(
      false, {1, 1, 8, 1, 0}, 8, launch_failed,
      {"byte 0 of an allocation of 32 bytes has a store by thread (0, 0, 0) of block (0, 0, 0)",
       "a store by thread (1, 0, 0)", "\"second statement\"", "no barrier"});
}
TEST_F(Simt, StoresOfOneValueByTwoThreadsAreNoRace) {
  ASSERT_EQ(run<store_the_same>(false, {1, 1, 8, 1, 0}, 8), success);
  EXPECT_EQ(left[3], 7);
}
// The stores do change these bytes, which nothing had stored before.
TEST_F(Simt, StoresThatOverlapInEqualValuesAreNoRace) {
  ASSERT_EQ(run<store_in_part_the_same>(false, {1, 1, 4, 1, 0}, 8), success);
  EXPECT_EQ(left[4], 7);
  expect_finding<store_in_part_others>(false, {1, 1, 4, 1, 0}, 8, launch_failed,
                                       {"byte 4 of an allocation of 32 bytes has a store"});
}
TEST_F(Simt, FindsRacesBetweenBlocks) {
  expect_finding<store_by_blocks>(false, {3, 1, 1, 1, 0}, 4, launch_failed,
                                  {"block (0, 0, 0)", "block (1, 0, 0)"});
}
TEST_F(Simt, FindsReadsThatAnotherBlockOverwrites) {
  expect_finding<read_and_store_by_blocks>(false, {2, 1, 4, 1, 0}, 4, launch_failed,
                                           {"has a load by", "a store by"});
}
TEST_F(Simt, AtomicUpdatesAreNoRaceAmongThemselves) {
  ASSERT_EQ(run<add_by_all>(false, {4, 1, 64, 1, 0}, 4), success);
  EXPECT_EQ(left[0], 256);
}
TEST_F(Simt, FindsAtomicUpdatesBesideStores) {
  expect_finding<add_and_store>(false, {1, 1, 8, 1, 0}, 4, launch_failed,
                                {"has a atomic update", "a store by thread (5, 0, 0)"});
}
TEST_F(Simt, BytesOfOneWordAreDifferentMemory) {
  ASSERT_EQ(run<store_bytes>(false, {1, 1, 16, 1, 0}, 4), success);
  EXPECT_EQ(left[1], 0x07060504);
}
TEST_F(Simt, FindsRacesOfBytesAndWords) {
  expect_finding<store_bytes_and_words>(false, {1, 1, 8, 1, 0}, 4, launch_failed,
                                        {"has a store by thread (0", "a load by thread (4"});
}
TEST_F(Simt, RacesAreNotLookedForWhenTheyAreNotAskedFor) {
  options.change([](auto& o) { o.find_races = 0; });
  EXPECT_EQ(run<store_by_two>(false, {1, 1, 8, 1, 0}, 8), success);
}

void pass_on_in_warp(Thread* t, int32_t* data, int32_t) {
  store(t, data + t->thread[0], t->thread[0], 0);
  t->calls->warp_barrier(t, 1);
  const int32_t other = load(t, data + (t->thread[0] ^ 1), 2);
  t->calls->warp_barrier(t, 1);
  store(t, data + t->thread[0], other, 0);
}
void pass_on_between_warps(Thread* t, int32_t* data, int32_t) {
  store(t, data + t->thread[0], t->thread[0], 0);
  t->calls->warp_barrier(t, 1);
  load(t, data + (t->thread[0] ^ 32), 2);
}

TEST_F(Simt, BarriersOfAWarpOrderTheWarpAlone) {
  ASSERT_EQ(run<pass_on_in_warp>(true, {1, 1, 64, 1, 0}, 64), success);
  EXPECT_EQ(left[6], 7);
  expect_finding<pass_on_between_warps>(true, {1, 1, 64, 1, 0}, 64, launch_failed,
                                        {"\"third statement\""});
}

// One thread stores; another loads after the warp has waited n times.
void wait_often(Thread* t, int32_t* data, int32_t n) {
  if (t->thread[0] == 0) store(t, data, 7, 0);
  for (int32_t i = 0; i < n; i++) t->calls->warp_barrier(t, 1);
  if (t->thread[0] == 1) load(t, data, 2);
}

TEST_F(Simt, BarriersOfAWarpOrderHoweverManyThereAre) {
  for (const int32_t times : {1, 1 << 16})
    EXPECT_EQ(run<wait_often>(true, {1, 1, 2, 1, 0}, times), success)
        << times << retrograde_simt_last_finding();
}

// ---- barriers and shuffles that some threads do not reach ----

void barrier_of_half(Thread* t, int32_t*, int32_t) {
  if (t->thread[0] < 16) barrier(t, 1);
}
void two_barriers(Thread* t, int32_t*, int32_t) { barrier(t, t->thread[0] == 9 ? 2 : 1); }
void shuffle_of_half(Thread* t, int32_t*, int32_t) {
  if (t->thread[0] % 2) shuffle(t, 1, 1, retrograde_simt_xor, 0);
}
void shuffle_beside_barrier(Thread* t, int32_t*, int32_t) {
  if (t->thread[0] == 3)
    barrier(t, 1);
  else
    shuffle(t, 1, 1, retrograde_simt_xor, 0);
}
void shuffle_beyond(Thread* t, int32_t*, int32_t) { shuffle(t, 1, 16, retrograde_simt_xor, 0); }
void barrier_unsaid(Thread* t, int32_t*, int32_t) { barrier(t, 1); }

TEST_F(Simt, FindsBarriersThatNotAllThreadsReach) {
  expect_finding<barrier_of_half>(
      true, {1, 1, 32, 1, 0}, 4, launch_failed,
      {"all threads of a block arrive at the same barrier", "thread (0, 0, 0)",
       "\"second statement\"", "thread (16, 0, 0) of block (0, 0, 0) has ended"});
}
TEST_F(Simt, FindsThreadsAtDifferentBarriers) {
  expect_finding<two_barriers>(true, {1, 1, 32, 1, 0}, 4, launch_failed,
                               {"\"second statement\"", "thread (9, 0, 0)", "\"third statement\""});
}
TEST_F(Simt, FindsShufflesThatNotAllLanesReach) {
  expect_finding<shuffle_of_half>(true, {1, 1, 32, 1, 0}, 4, launch_failed,
                                  {"all lanes of a warp arrive at a shuffle",
                                   "thread (1, 0, 0) of block (0, 0, 0) waits at a shuffle",
                                   "\"first statement\"", "thread (0, 0, 0)", "has ended"});
}
TEST_F(Simt, FindsShufflesBesideBarriers) {
  expect_finding<shuffle_beside_barrier>(true, {1, 1, 32, 1, 0}, 4, launch_failed,
                                         {"thread (3, 0, 0)", "waits at a barrier"});
}
TEST_F(Simt, FindsShufflesFromLanesThatAreNotThere) {
  expect_finding<shuffle_beyond>(true, {1, 1, 16, 1, 0}, 4, launch_failed,
                                 {"lane 16 of a warp of 16 threads"});
}
TEST_F(Simt, AKernelThatWaitsMustSaySo) {
  expect_finding<barrier_unsaid>(false, {1, 1, 4, 1, 0}, 4, launch_failed, {"suspends"});
}

// ---- bounds ----

void store_beyond(Thread* t, int32_t* data, int32_t n) { store(t, data + n + t->thread[0], 1, 1); }
void load_before(Thread* t, int32_t* data, int32_t) { load(t, data - 1, 0); }
void load_across(Thread* t, int32_t* data, int32_t n) {
  load(t, reinterpret_cast<int64_t*>(data + n - 1), 0);
}
void shared_beyond(Thread* t, int32_t*, int32_t) {
  load(t, reinterpret_cast<int32_t*>(t->shared) + 8, 2, retrograde_simt_shared);
}

TEST_F(Simt, FindsAccessesOutsideOfAllocations) {
  expect_finding<store_beyond>(false, {1, 1, 4, 1, 0}, 8, illegal_address,
                               {"thread (0, 0, 0)", "store of 4 bytes", "\"second statement\""});
}
TEST_F(Simt, FindsAccessesBeforeAllocations) {
  expect_finding<load_before>(false, {1, 1, 4, 1, 0}, 8, illegal_address, {"load of 4 bytes"});
}
TEST_F(Simt, FindsAccessesAcrossTheEnd) {
  expect_finding<load_across>(false, {1, 1, 1, 1, 0}, 8, illegal_address,
                              {"load of 8 bytes", "byte 28 of an allocation of 32 bytes"});
}
TEST_F(Simt, FindsAccessesOutsideOfSharedMemory) {
  expect_finding<shared_beyond>(false, {1, 1, 4, 1, 32}, 8, illegal_address,
                                {"byte 32 of shared memory", "the block has 32"});
}
TEST_F(Simt, FindsUsesOfMemoryThatWasFreed) {
  const Image image{saxpy_kernel()};
  Address x = allocate(400), y = allocate(400);
  float a = 1;
  int32_t n = 100;
  ASSERT_EQ(cuMemFree_v2(x), success);
  ASSERT_EQ(launch(function_of(image, "saxpy"), {1, 1, 128, 1, 0}, {&x, &y, &a, &n}), success);
  EXPECT_EQ(cuStreamSynchronize(stream), illegal_address);
  EXPECT_EQ(cuStreamSynchronize(stream), illegal_address) << "the context is lost";
  const char* text = nullptr;
  ASSERT_EQ(cuGetErrorString(illegal_address, &text), success);
  EXPECT_NE(std::string(text).find("\"x(i)\""), std::string::npos) << text;
}

}  // namespace
