// main() of a program that runs one compiled function from the command line. It is linked with the function's library
// and with the registration file that the generator writes beside it.
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <iostream>

#include "run_gen/filter.h"

// Called by registration files before main() runs.
extern "C" void halide_register_argv_and_metadata(int (*filter_argv_call)(void**),
                                                  const halide_filter_metadata_t* metadata,
                                                  const char* const*) {
  retrograde::run_gen::registered_filters().push_back({filter_argv_call, metadata});
}

namespace retrograde::run_gen {
namespace {

// ---- memory ----

// Each block is preceded by its size.
constexpr size_t header_bytes = 128;
std::atomic<int64_t> bytes_now{0}, bytes_most{0};

void* counting_malloc(void*, size_t bytes) {
  auto* block = static_cast<char*>(std::aligned_alloc(
      header_bytes, (bytes + 2 * header_bytes - 1) / header_bytes * header_bytes));
  if (!block) return nullptr;
  *reinterpret_cast<size_t*>(block) = bytes;
  const int64_t now = bytes_now += static_cast<int64_t>(bytes);
  int64_t most = bytes_most;
  while (now > most && !bytes_most.compare_exchange_weak(most, now)) {
  }
  return block + header_bytes;
}

void counting_free(void*, void* block) {
  if (!block) return;
  char* begin = static_cast<char*>(block) - header_bytes;
  bytes_now -= static_cast<int64_t>(*reinterpret_cast<size_t*>(begin));
  std::free(begin);
}

// ---- a run ----

int run_once(Call& call, const Filter& filter) {
  int code = call.run();
  if (code == 0) code = call.bring_results();
  if (code != 0)
    std::cerr << "Error: " << filter.metadata->name << " returned the error code " << code << "\n";
  return code;
}

double seconds_of(Call& call, int iterations) {
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < iterations; i++) call.run();
  call.wait();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  return elapsed.count();
}

struct Timing {
  double best;  // seconds of one call
  int samples, iterations;
};

// The best time of several samples, each long enough for the clock's resolution.
Timing benchmark(Call& call, double min_seconds) {
  constexpr int min_samples = 3, max_iterations = 1 << 24;
  int iterations = 1;
  double elapsed = seconds_of(call, iterations);
  while (elapsed * min_samples < min_seconds && iterations < max_iterations) {
    iterations *= 2;
    elapsed = seconds_of(call, iterations);
  }
  Timing timing{elapsed / iterations, 1, iterations};
  for (double total = elapsed; timing.samples < min_samples || total < min_seconds;
       timing.samples++) {
    const double next = seconds_of(call, iterations);
    timing.best = std::min(timing.best, next / iterations);
    total += next;
  }
  return timing;
}

void tell_timing(const Options& options, const std::string& name, const Timing& timing,
                 double elements) {
  const double rate = elements / 1e6 / timing.best;
  if (options.parsable) {
    std::cout << name << "  BEST_TIME_MSEC_PER_ITER  " << timing.best * 1e3 << "\n"
              << name << "  SAMPLES  " << timing.samples << "\n"
              << name << "  ITERATIONS  " << timing.iterations << "\n"
              << name << "  THROUGHPUT_MPIX_PER_SEC  " << rate << "\n";
    return;
  }
  std::cout << "Benchmark for " << name << ": best time " << timing.best << " sec/iter (of "
            << timing.samples << " samples of " << timing.iterations << " iterations)\n"
            << "Throughput: " << rate << " megapixels of output per second\n";
}

void tell_memory(const Options& options, const std::string& name) {
  if (options.parsable)
    std::cout << name << "  MEMORY_HIGH_WATER_BYTES  " << bytes_most << "\n";
  else
    std::cout << "Intermediate results of " << name << " took at most " << bytes_most << " bytes\n";
}

void set_handlers(const Options& options) {
  halide_set_error_handler([](void*, const char* text) { std::cerr << "Error: " << text << "\n"; });
  if (options.quiet) halide_set_custom_print([](void*, const char*) {});
  if (!options.track_memory) return;
  halide_set_custom_malloc(counting_malloc);
  halide_set_custom_free(counting_free);
}

int run(const Options& options) {
  const Filter filter = find_filter(options.filter);
  if (options.describe) {
    std::cout << description(filter);
    return 0;
  }
  set_handlers(options);
  const std::string name = filter.metadata->name;
  Call call(filter, options);
  if (options.verbose) std::cout << call.shapes();
  if (run_once(call, filter) != 0) return 1;
  if (options.benchmark)
    tell_timing(options, name, benchmark(call, options.min_seconds), call.output_elements());
  if (options.track_memory) tell_memory(options, name);
  call.write_outputs();
  return 0;
}

std::string base_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

int run_program(int argc, const char* const* argv) {
  try {
    const Options options = read_options(argc, argv);
    if (argc <= 1 || options.help) {
      std::cout << usage(base_name(argv[0]));
      return argc <= 1 ? 1 : 0;
    }
    return run(options);
  } catch (const std::exception& problem) {
    std::cerr << "Error: " << problem.what() << "\n";
    return 1;
  }
}

}  // namespace
}  // namespace retrograde::run_gen

int main(int argc, char** argv) { return retrograde::run_gen::run_program(argc, argv); }
