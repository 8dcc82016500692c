// Times the programs relative to the device's limits. Copy bandwidth and FMA rate are measured in the same run, by our
// own kernels through the same runtime.
#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "retrograde/retrograde.h"
#include "support/gpu_programs.h"
#include "worker.h"

namespace device_check {
namespace {

using namespace retrograde;
using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Seconds per run: the median of batches, each so long that the final wait is negligible. If `seconds` is 0, the time
// of a single run.
double time_of(const std::function<void()>& run, const std::function<void()>& wait,
               double seconds) {
  constexpr size_t batches = 7;
  run();  // compiles, loads, copies the inputs
  wait();
  auto begin = Clock::now();
  run();
  wait();
  const double once = std::max(seconds_since(begin), 1e-7);
  if (seconds == 0) return once;
  const int runs = std::clamp(static_cast<int>(seconds / batches / once), 1, 1000);
  std::vector<double> times;
  for (size_t batch = 0; batch < batches; ++batch) {
    begin = Clock::now();
    for (int i = 0; i < runs; ++i) run();
    wait();
    times.push_back(seconds_since(begin) / runs);
  }
  std::nth_element(times.begin(), times.begin() + batches / 2, times.end());
  return times[batches / 2];
}

// Results stay on the device.
double time_realizing(Func f, const std::vector<int>& sizes, const Target& target, double seconds) {
  Buffer<float> result(sizes);
  const double time =
      time_of([&] { f.realize(result, target); }, [&] { result.device_sync(); }, seconds);
  result.copy_to_host();
  return time;
}

// ---- what the device can do ----

// In bytes per second, reads plus writes.
double copy_bandwidth(const Target& target, const Timings& options) {
  const int elements = options.is_small ? 1 << 12 : 1 << 26;
  Buffer<float> in(elements);
  in.fill(1.0f);
  Var x("x"), block("block"), thread("thread"), lane("lane");
  Func out("copied");
  out(x) = in(x);
  out.split(x, block, lane, 1024)
      .split(lane, thread, lane, 4)
      .vectorize(lane)
      .gpu_blocks(block)
      .gpu_threads(thread);
  return 8.0 * elements / time_realizing(out, {elements}, target, options.share(20));
}

// In operations per second; a product and a sum count as two.
double fma_rate(const Target& target, const Timings& options) {
  const int threads = options.is_small ? 1 << 8 : 1 << 20, steps = options.is_small ? 16 : 4096;
  constexpr int chains = 8;  // independent chains per thread, which hide latency
  Var x("x"), k("k"), xi("xi");
  RDom r(0, steps, "r");
  Func sums("sums"), out("fused");
  sums(x, k) = cast<float>(x + k);
  sums(x, k) = sums(x, k) * 0.999f + cast<float>(r % 2);
  Expr total = 0.0f;
  for (int i = 0; i < chains; ++i) total += sums(x, i);
  out(x) = total;
  out.gpu_tile(x, xi, 256);
  sums.compute_at(out, xi).bound(k, 0, chains).unroll(k);
  sums.update().reorder(k, r).unroll(k);
  return 2.0 * threads * steps * chains / time_realizing(out, {threads}, target, options.share(20));
}

}  // namespace

std::string time_programs(const Target& target, const Timings& options) {
  const auto begin = Clock::now();
  const double bandwidth = copy_bandwidth(target, options), rate = fma_rate(target, options);
  Json json = {{"copy_gigabytes_per_second", bandwidth / 1e9},
               {"fma_gigaflops", rate / 1e9},
               {"programs", Json::array()}};
  for (const gpu_programs::Program& small : gpu_programs::all()) {
    if (!options.only.empty() && std::ranges::find(options.only, small.name) == options.only.end())
      continue;
    if (seconds_since(begin) > options.seconds) {
      json["programs"].push_back({{"name", small.name}, {"note", "no time was left"}});
      continue;
    }
    const int scale = options.is_small ? 1 : small.timing_scale;
    const gpu_programs::Program program = gpu_programs::named(small.name, scale);
    const double seconds =
        time_realizing(program.build(true), program.sizes, target, options.share(40));
    const double least = std::max(program.bytes / bandwidth, program.operations / rate);
    Json one = {
        {"name", program.name},
        {"scale", scale},
        {"sizes", program.sizes},
        {"milliseconds", seconds * 1e3},
        {"bytes", program.bytes},
        {"operations", program.operations},
        {"least_milliseconds", least * 1e3},
        {"bound_by", program.bytes / bandwidth >= program.operations / rate ? "bandwidth" : "FMA"},
        {"share_of_bound", least / seconds}};
    json["programs"].push_back(one);
  }
  return json.dump(2);
}

}  // namespace device_check
