// Every figure is that of code such as this compiler makes, so that what it does well or badly counts.
// Of an operation: rows of an array in L1 that do few and many of it to each element; the difference is
// free of what both do. Of a level: a triad over as many bytes as lie there, whose stores count twice,
// as the model counts them. Times are the best of several.
#include "tuning/calibrate.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "autoschedule/machine/kept_machine.h"
#include "frontend/data/buffer.h"
#include "frontend/language/expr_ops.h"
#include "frontend/language/func.h"
#include "frontend/language/inline_reductions.h"
#include "frontend/language/rdom.h"
#include "huge_pages.h"

namespace retrograde::tuning {

namespace {

using Clock = std::chrono::steady_clock;
using Step = std::function<Expr(Expr)>;

double best_ns(const std::function<void()>& run, double budget_seconds = 0.02) {
  run();  // compiles
  double best = std::numeric_limits<double>::infinity();
  const auto begin = Clock::now();
  const auto since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  for (int i = 0; i < 3 || since(begin) < budget_seconds; i++) {
    const auto start = Clock::now();
    run();
    best = std::min(best, since(start));
  }
  return best * 1e9;
}

double best_ns(Func& f, Buffer<>& out, const Target& target, double budget_seconds = 0.02) {
  return best_ns([&] { f.realize(out, target); }, budget_seconds);
}

Buffer<> filled(Type type, const std::vector<int>& sizes, double value) {
  Buffer<> result(type, sizes);
  const size_t count = result.number_of_elements();
  for (size_t i = 0; i < count; i++) {
    if (type == Float(32)) reinterpret_cast<float*>(result.data())[i] = static_cast<float>(value);
    if (type == Float(64)) reinterpret_cast<double*>(result.data())[i] = value;
    if (type == Int(32))
      reinterpret_cast<int32_t*>(result.data())[i] =
          static_cast<int32_t>(value + static_cast<double>(i * 37 % 1021));
  }
  return result;
}

// ---- operations ----

class Operations {
 public:
  explicit Operations(const Target& target) : target_(target) {}

  // Of one step on a vector, or, without vectors, on a value.
  double step_ns(Type type, const Step& step, int few, int many, bool vectors = true) const {
    const int lanes = vectors ? target_.natural_vector_size(type) : 1;
    const double count = static_cast<double>(columns) / lanes * rows * (many - few);
    return std::max(0.01,
                    (time_ns(type, step, many, lanes) - time_ns(type, step, few, lanes)) / count);
  }

  double gather_lane_ns() const {
    const Buffer<> places = filled(Int(32), {columns}, 0), table = filled(Float(32), {1024}, 1);
    const auto sum = [&](int times) {
      Func f;
      Var x, y;
      Expr e = 0.0f;
      for (int i = 0; i < times; i++)
        e = e + table.as<float>()(clamp(places.as<int>()(x) + i, 0, 1023));
      f(x, y) = e;
      f.vectorize(x, target_.natural_vector_size(Float(32)));
      Buffer<> out(Float(32), {columns, rows});
      return best_ns(f, out, target_);
    };
    return std::max(0.02, (sum(5) - sum(1)) / (4.0 * columns * rows));
  }

  double scatter_lane_ns() const {
    const Buffer<> in = filled(Float(32), {64, 64}, 1);
    Func f;
    Var x, y;
    f(x, y) = in.as<float>()(y, x);
    f.reorder(y, x).vectorize(y, target_.natural_vector_size(Float(32)));
    Buffer<> out(Float(32), {64, 64});
    return best_ns(f, out, target_) / (64.0 * 64);
  }

  double load_ns() const {
    const auto sum = [&](int taps) {
      const Buffer<> in = filled(Float(32), {columns + taps}, 1);
      Func f;
      Var x, y;
      Expr e = 0.0f;
      for (int i = 0; i < taps; i++) e = e + in.as<float>()(x + i);
      f(x, y) = e;
      f.vectorize(x, target_.natural_vector_size(Float(32)));
      Buffer<> out(Float(32), {columns, rows});
      return best_ns(f, out, target_);
    };
    const double vectors = 1.0 * columns / target_.natural_vector_size(Float(32)) * rows;
    return std::max(0.02, (sum(24) - sum(8)) / (16 * vectors));
  }

  // A copy in L1, of two lengths.
  double load_and_store_ns() const {
    const auto copy = [&](int length) {
      const Buffer<> in = filled(Float(32), {length}, 1);
      Func f;
      Var x;
      f(x) = in.as<float>()(x);
      f.vectorize(x, target_.natural_vector_size(Float(32)));
      Buffer<> out(Float(32), {length});
      return best_ns(f, out, target_);
    };
    return std::max(0.05,
                    (copy(4096) - copy(1024)) / (3072.0 / target_.natural_vector_size(Float(32))));
  }

  double latency_ns() const {
    constexpr int length = 1 << 14;
    const Buffer<> in = filled(Float(32), {length}, 1);
    Func f;
    RDom r(0, length);
    f() = 0.0f;
    f() = f() * 0.5f + in.as<float>()(r);
    Buffer<> out = Buffer<>(Float(32), std::vector<int>{});
    return best_ns(f, out, target_) / length;
  }

  // What a loop of as many tasks as threads takes beyond its share of the work.
  double launch_ns(int threads) const {
    const auto tasks = [&](bool parallel) {
      Func f;
      Var x, y;
      f(x, y) = exp(cast<float>(x * y));
      f.vectorize(x, target_.natural_vector_size(Float(32)));
      if (parallel) f.parallel(y);
      Buffer<> out(Float(32), {1 << 15, threads});
      return best_ns(f, out, target_);
    };
    return std::max(1000.0, tasks(true) - tasks(false) / threads);
  }

 private:
  static constexpr int columns = 1024, rows = 32;
  const Target target_;

  double time_ns(Type type, const Step& step, int times, int lanes) const {
    const Buffer<> in = filled(type, {columns}, 1);
    Func f;
    Var x, y;
    Expr e = type == Float(32)   ? Expr(in.as<float>()(x))
             : type == Float(64) ? Expr(in.as<double>()(x))
                                 : Expr(in.as<int>()(x));
    for (int i = 0; i < times; i++) e = step(e);
    f(x, y) = e;
    if (lanes > 1) f.vectorize(x, lanes);
    Buffer<> out(type, {columns, rows});
    return best_ns(f, out, target_);
  }
};

void measure_operations(planning::Machine& m, const Target& target) {
  const Operations operations(target);
  const Type f32 = Float(32), f64 = Float(64);
  m.operation_ns = operations.step_ns(
      f32, [](Expr e) { return e * 0.5f + 0.25f; }, 4, 16);
  m.divide_ns = operations.step_ns(
      f32, [](Expr e) { return 1.5f / e; }, 2, 8);
  m.divide_double_ns = operations.step_ns(
      f64, [](Expr e) { return Expr(1.5) / e; }, 2, 8);
  m.sqrt_ns = operations.step_ns(
      f32, [](Expr e) { return sqrt(e); }, 2, 8);
  m.sqrt_double_ns = operations.step_ns(
      f64, [](Expr e) { return sqrt(e); }, 2, 8);
  m.exp_ns = operations.step_ns(
      f32, [](Expr e) { return exp(0.0f - e); }, 1, 3);
  m.log_ns = operations.step_ns(
      f32, [](Expr e) { return log(e + 1.5f); }, 1, 3);
  m.pow_ns = operations.step_ns(
      f32, [](Expr e) { return pow(e, 1.3f); }, 1, 3);
  m.sin_ns = operations.step_ns(
      f32, [](Expr e) { return sin(e); }, 1, 3);
  m.scalar_divide_ns = operations.step_ns(
      Int(32), [](Expr e) { return 100000 / max(e, 1); }, 1, 4, false);
  m.load_ns = operations.load_ns();
  m.store_ns = std::max(0.5 * m.load_ns, operations.load_and_store_ns() - 0.5 * m.load_ns);
  m.gather_lane_ns = operations.gather_lane_ns();
  m.scatter_lane_ns = operations.scatter_lane_ns();
  m.latency_ns = operations.latency_ns();
  m.launch_ns = operations.launch_ns(m.threads);
  // Two multiply-adds a cycle on all that this is for; of the others a cycle, or half of one.
  const double cycle = 2 * m.operation_ns;
  m.shuffle_ns = cycle;
  m.scalar_ns = cycle / 4;
  m.iteration_ns = cycle;
  m.memory_latency_ns = m.latency_ns + 5 * cycle;
}

// ---- memory ----

double cache_bytes(int name, double otherwise) {
  const long bytes = sysconf(name);
  return bytes > 0 ? static_cast<double>(bytes) : otherwise;
}

// Of arrays of the largest size, which the smaller ones are a part of.
class Triad {
 public:
  Triad(double most_bytes, const Target& target, int threads)
      : rows_(static_cast<int>(most_bytes / array_count / row_bytes)),
        a_(filled(Float(32), {columns, rows_}, 1)),
        b_(filled(Float(32), {columns, rows_}, 2)),
        out_(filled(Float(32), {columns, rows_}, 0)),
        target_(target),
        threads_(threads) {}

  // Bytes a nanosecond where all arrays together are so large.
  double rate(double bytes, bool parallel) {
    const int rows =
        std::clamp(static_cast<int>(bytes / array_count / row_bytes), 2 * threads_, rows_);
    Func f;
    Var x, y, task, row;
    f(x, y) = a_.as<float>()(x, y) + 0.5f * b_.as<float>()(x, y);
    f.vectorize(x, target_.natural_vector_size(Float(32)));
    if (parallel) f.split(y, task, row, (rows + threads_ - 1) / threads_).parallel(task);
    // Often enough in a call that launching counts for little.
    Buffer<> out = out_.cropped(1, 0, rows);
    const double ns = best_ns(f, out, target_, 0.03);
    return (array_count + 1) * row_bytes * rows / ns;
  }

 private:
  static constexpr int columns = 512;
  static constexpr double row_bytes = columns * 4.0, array_count = 3;
  const int rows_;
  Buffer<> a_, b_, out_;
  const Target target_;
  const int threads_;
};

void measure_memory(planning::Machine& m, const Target& target) {
  const double l1 = cache_bytes(_SC_LEVEL1_DCACHE_SIZE, planning::first_cache_bytes);
  const double l2 = cache_bytes(_SC_LEVEL2_CACHE_SIZE, planning::second_cache_bytes);
  const double most = 384 << 20;
  Triad triad(most, target, m.threads);
  const auto level = [&](const char* name, double bytes, double at) {
    return planning::Machine::Level{name, bytes, triad.rate(at, false),
                                    triad.rate(at * m.threads, true)};
  };
  m.levels[0] = level("L1", l1, l1 / 2);
  m.levels[1] = level("L2", l2, 0.6 * l2);
  m.levels[2] = level("L3", 0, 2.5 * l2);
  m.levels[3] = {"memory", 1e15, triad.rate(most, false), triad.rate(most, true)};
  // What processors say of a cache that others share says little: where the rate falls, it ends.
  const double between = std::sqrt(m.levels[2].all_threads * m.levels[3].all_threads);
  double last = 2.5 * l2;
  for (double bytes = 2 * last; bytes < most; bytes *= 2) {
    if (triad.rate(bytes, true) < between) break;
    last = bytes;
  }
  m.levels[2].bytes = last;
}

double page_ns() {
  constexpr size_t bytes = size_t{64} << 20, page = planning::page_bytes;
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return planning::Machine().page_ns;
  runtime::advise_huge_pages(memory, bytes);  // as for the runtime's blocks
  const auto begin = Clock::now();
  for (size_t at = 0; at < bytes; at += page) static_cast<volatile char*>(memory)[at] = 1;
  const std::chrono::duration<double, std::nano> taken = Clock::now() - begin;
  munmap(memory, bytes);
  return std::max(1.0, taken.count() / (static_cast<double>(bytes) / page));
}

}  // namespace

planning::Machine calibrate(const Target& target) {
  planning::Machine machine = planning::constants_for(target);
  machine.name = planning::processor_name();
  measure_operations(machine, target);
  measure_memory(machine, target);
  machine.page_ns = page_ns();
  return machine;
}

}  // namespace retrograde::tuning
