// machine.cpp -- see machine.h.
#include "machine.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#ifdef __x86_64__
#include <immintrin.h>
#endif

namespace bench {

namespace {

using Clock = std::chrono::steady_clock;

// The least of `times` measurements of `work(thread)` running on all threads at once, in seconds.
double best_seconds(int threads, int times, const std::function<void(int)>& work) {
  double best = 1e30;
  for (int i = 0; i < times; i++) {
    const Clock::time_point start = Clock::now();
    std::vector<std::thread> others;
    for (int t = 1; t < threads; t++) others.emplace_back(work, t);
    work(0);
    for (std::thread& other : others) other.join();
    best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return best;
}

// ---- bandwidth ----

__attribute__((optimize("O3"), noinline)) void triad(float* __restrict a, const float* __restrict b,
                                                     const float* __restrict c, size_t n) {
  for (size_t i = 0; i < n; i++) a[i] = b[i] + 3.0f * c[i];
}

double measure_bandwidth(int threads) {
  const size_t n = size_t{24} << 20;  // elements of each array: 96 MiB, larger than any cache here
  std::unique_ptr<float[]> a(new float[n]), b(new float[n]), c(new float[n]);
  auto part = [&](int thread, auto&& f) {
    const size_t first = n * thread / threads, last = n * (thread + 1) / threads;
    f(first, last - first);
  };
  best_seconds(threads, 1, [&](int thread) {
    part(thread, [&](size_t first, size_t count) {
      std::fill_n(a.get() + first, count, 0.0f);
      std::fill_n(b.get() + first, count, 1.0f);
      std::fill_n(c.get() + first, count, 2.0f);
    });
  });
  const double seconds = best_seconds(threads, 12, [&](int thread) {
    part(thread, [&](size_t first, size_t count) {
      triad(a.get() + first, b.get() + first, c.get() + first, count);
    });
  });
  return 3.0 * sizeof(float) * static_cast<double>(n) / seconds;
}

// ---- multiply-adds: enough independent chains to hide the latency ----

constexpr int chains = 16;
constexpr int64_t steps = 4'000'000;
volatile float sink;

void fma_plain() {
  float sums[chains];
  for (int i = 0; i < chains; i++) sums[i] = static_cast<float>(i);
  for (int64_t s = 0; s < steps; s++) {
    for (int i = 0; i < chains; i++) sums[i] = sums[i] * 0.5f + 0.25f;
  }
  for (int i = 0; i < chains; i++) sink = sums[i];
}

#ifdef __x86_64__
#define FMA_CHAINS(vector, set1, fmadd)                                   \
  vector sums[chains];                                                    \
  const vector half = set1(0.5f), quarter = set1(0.25f);                  \
  for (int i = 0; i < chains; i++) sums[i] = set1(static_cast<float>(i)); \
  for (int64_t s = 0; s < steps; s++) {                                   \
    _Pragma("GCC unroll 16") for (int i = 0; i < chains; i++) sums[i] =   \
        fmadd(sums[i], half, quarter);                                    \
  }                                                                       \
  for (int i = 0; i < chains; i++) sink = sums[i][0];

__attribute__((target("avx512f"), optimize("O3"))) void fma_512() {
  FMA_CHAINS(__m512, _mm512_set1_ps, _mm512_fmadd_ps)
}
__attribute__((target("avx2,fma"), optimize("O3"))) void fma_256() {
  FMA_CHAINS(__m256, _mm256_set1_ps, _mm256_fmadd_ps)
}
#undef FMA_CHAINS
#endif

double measure_flops(int threads) {
  int lanes = 1;
  void (*work)() = fma_plain;
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) lanes = 8, work = fma_256;
  if (__builtin_cpu_supports("avx512f")) lanes = 16, work = fma_512;
#endif
  const double seconds = best_seconds(threads, 8, [&](int) { work(); });
  return 2.0 * lanes * chains * static_cast<double>(steps) * threads / seconds;
}

}  // namespace

Machine measure_machine(int threads) {
  Machine machine;
  const int all = static_cast<int>(std::thread::hardware_concurrency());
  machine.threads = std::max(1, threads > 0 ? threads : all);
  machine.bytes_per_second = measure_bandwidth(machine.threads);
  machine.flops_one_thread = measure_flops(1);
  machine.flops_all_threads = measure_flops(machine.threads);
  return machine;
}

double bound_seconds(const Machine& machine, int threads, double bytes, double operations) {
  return std::max(bytes / machine.bytes_per_second, operations / machine.flops(threads));
}

}  // namespace bench
