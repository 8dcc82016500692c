// worker_main.cpp -- compiles one kernel and runs it on request. The same source is built with Halide and with
// Retrograde (BENCH_RETROGRADE), for kernels and for operators (BENCH_OPERATORS). See worker_protocol.h.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "../gradients/gradient.h"
#include "../gradients/slope.h"
#include "process_memory.h"
#include "worker_orders.h"
#include "worker_protocol.h"

namespace {

kernels::Kernel make_kernel(const std::string& name, const kernels::Setup& setup) {
#define KERNEL(known) \
  if (name == #known) return kernels::known(setup);
#ifndef BENCH_FORWARD  // a list without gradients
#define GRADIENT(known) KERNEL(known)
#endif
#define OPERATOR(known) KERNEL(known)
#ifdef BENCH_OPERATORS
#include "../operators/list.def"
#else
#include "../list.def"
#endif
  throw std::runtime_error("there is no kernel \"" + name + "\"");
}

// Halide 14 mistakes recent AMD processors for ones with AMX, and its code would not run. Ours leaves AMX out too, so
// that both sides have the same target.
Halide::Target target() {
  return Halide::get_jit_target_from_environment().without_feature(
      Halide::Target::AVX512_SapphireRapids);
}

class Worker {
 public:
  Worker(const std::string& name, bool small, int threads, const std::string& schedule)
      : name_(name), threads_(threads) {
    const kernels::Stopwatch starting;
    Halide::Func first("first");
    Halide::Var x("x");
    first(x) = x;
    Halide::Buffer<int> values(16);
    first.realize(values, target_);
    start_seconds_ = starting.seconds();
    setup_.target = target_;
    setup_.small = small;
    setup_.threads = threads;
    setup_.schedule = schedule;
#ifdef BENCH_OPERATORS
    setup_.is_operator = true;
#endif
    kernel_ = make_kernel(name, setup_);
    if (!setup_.is_operator && !setup_.by_hand()) kernels::schedule_kernel(kernel_, setup_);
  }

  void compile() {
    limit_threads(threads_);
    const kernels::Stopwatch compiling;
    kernel_.pipeline.compile_jit(target_);
    const double seconds = compiling.seconds();
    std::cout << "ready " << seconds << " " << start_seconds_ << " " << bytes() << " "
              << kernel_.operations << " " << kernel_.derive_seconds << " "
              << kernel_.search_seconds << std::endl;
    compile_peak_mb_ = bench::status_mb("VmHWM");
    bench::forget_peak();
    resident_mb_ = bench::status_mb("VmRSS");
  }

  void set_threads(int threads) {
    limit_threads(threads);
    std::cout << "set" << std::endl;
  }

  void run() {
    Halide::Realization outputs(kernel_.outputs);
    const kernels::Stopwatch running;
    kernel_.pipeline.realize(outputs, target_);
    std::cout << "ran " << running.seconds() << std::endl;
  }

  void save(const std::string& path) const {
    write(path, kernel_.outputs);
    std::cout << "saved" << std::endl;
  }

  void save_inputs(const std::string& path) const {
    write(path, kernel_.inputs);
    std::cout << "saved";
    for (const auto& input : kernel_.inputs) {
      std::cout << " " << input.dimensions();
      for (int d = 0; d < input.dimensions(); d++) std::cout << " " << input.dim(d).extent();
    }
    std::cout << std::endl;
  }

  void tell_slope() {
    if (setup_.is_operator) {  // the program's output is computed together with its gradients
      std::cout << "slope " << kernels::slope_error(kernel_, kernel_, target_) << std::endl;
      return;
    }
    setup_.primal = true;
    kernels::Kernel primal = make_kernel(name_, setup_);
    std::cout << "slope " << kernels::slope_error(kernel_, primal, target_) << std::endl;
  }

#ifdef BENCH_RETROGRADE
  // Writes the predicted and measured time of every stage as JSON.
  void explain(const std::string& path, double seconds) {
    retrograde::ExplainOptions options;
    options.measure = seconds > 0;
    options.seconds = seconds;
    options.threads = threads_;
    const auto report = kernel_.pipeline.explain_schedule(kernel_.outputs, target_, options);
    std::ofstream file(path);
    file << report.to_json();
    if (!file.flush()) throw std::runtime_error("cannot write \"" + path + "\"");
    std::cout << "explained" << std::endl;
  }
#endif

  void tell_memory() const {
    const double run_peak = bench::status_mb("VmHWM");
    std::cout << "memory " << std::max(compile_peak_mb_, run_peak) << " "
              << std::max(0.0, run_peak - resident_mb_) << std::endl;
  }

 private:
  void limit_threads([[maybe_unused]] int threads) {
#ifdef BENCH_RETROGRADE
    kernel_.pipeline.jit_handlers().thread_limit = threads;  // Halide 14 reads HL_NUM_THREADS
#endif
  }

  static void write(const std::string& path, const std::vector<Halide::Buffer<>>& buffers) {
    std::ofstream file(path, std::ios::binary);
    for (const auto& buffer : buffers) {
      const auto& raw = *buffer.raw_buffer();
      const bench::OutputHeader header{raw.type.code, raw.type.bits,
                                       static_cast<int64_t>(buffer.number_of_elements())};
      file.write(reinterpret_cast<const char*>(&header), sizeof header);
      file.write(reinterpret_cast<const char*>(raw.host),
                 static_cast<std::streamsize>(header.count * raw.type.bytes()));
    }
    if (!file.flush()) throw std::runtime_error("cannot write \"" + path + "\"");
  }

  double bytes() const {
    double sum = 0;
    for (const auto& buffer : kernel_.inputs) sum += static_cast<double>(buffer.size_in_bytes());
    for (const auto& buffer : kernel_.outputs) sum += static_cast<double>(buffer.size_in_bytes());
    return sum;
  }

  Halide::Target target_ = target();
  std::string name_;
  int threads_;
  kernels::Setup setup_;
  kernels::Kernel kernel_;
  double start_seconds_ = 0, compile_peak_mb_ = 0, resident_mb_ = 0;
};

void obey(Worker& worker, const std::string& order, const std::string& word,
          [[maybe_unused]] std::istream& words) {
  if (order == "threads") worker.set_threads(std::stoi(word));
  if (order == "inputs") worker.save_inputs(word);
#ifdef BENCH_RETROGRADE
  double seconds = 0;
  if (order == "explain" && words >> seconds) worker.explain(word, seconds);
#endif
  if (order == "slope") worker.tell_slope();
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

int tell_failure(const char* what) {
  std::cout << "failed " << one_line(what) << std::endl;
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    std::fprintf(stderr, "usage: %s KERNEL small|full THREADS [SCHEDULE]\n", argv[0]);
    return 2;
  }
  ::alarm(bench::worker_deadline_seconds);
  std::cout.precision(9);
  try {
    Worker worker(argv[1], argv[2] == std::string("small"), std::stoi(argv[3]),
                  argc > 4 ? argv[4] : "");
    worker.compile();
    bench::serve(worker, [&](const auto& order, const auto& word, auto& words) {
      obey(worker, order, word, words);
    });
  } catch (const Halide::Error& error) {  // a std::exception in some versions of Halide only
    return tell_failure(error.what());
  } catch (const std::exception& error) {
    return tell_failure(error.what());
  }
}
