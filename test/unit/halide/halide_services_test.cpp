// Trace files, the cache of memoized results and parallel tasks of the static runtime, called
// through HalideRuntime.h without generated code.
#include <HalideBuffer.h>
#include <HalideRuntime.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "retrograde_runtime.h"
#include "support/temporary_folder.h"

namespace {

using Halide::Runtime::Buffer;

std::string prints;

class HalideServices : public testing::Test {
 protected:
  HalideServices() {
    prints.clear();
    halide_set_custom_print([](void*, const char* text) { prints += text; });
  }
  ~HalideServices() override {
    halide_set_custom_print(nullptr);
    halide_set_error_handler(nullptr);
    halide_set_custom_malloc(nullptr);
    halide_set_custom_free(nullptr);
    halide_memoization_cache_cleanup();
    halide_set_trace_file(0);
  }
};

// ---- traces ----

halide_trace_event_t event_of(const char* func, int32_t* coordinates, int32_t* value) {
  halide_trace_event_t event = {};
  event.func = func;
  event.event = halide_trace_store;
  event.type = halide_type_of<int32_t>();
  event.coordinates = coordinates;
  event.dimensions = 2;
  event.value = value;
  event.parent_id = 5;
  return event;
}

void trace(const char* func) {
  int32_t coordinates[] = {3, -4}, value = 77;
  const halide_trace_event_t event = event_of(func, coordinates, &value);
  EXPECT_GT(halide_trace(nullptr, &event), 0);
}

void expect_packets(const std::string& path, const std::vector<std::string>& funcs) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  size_t at = 0;
  for (const std::string& func : funcs) {
    ASSERT_GE(bytes.size(), at + sizeof(halide_trace_packet_t));
    const auto& packet = *reinterpret_cast<const halide_trace_packet_t*>(bytes.data() + at);
    ASSERT_LE(at + packet.size, bytes.size());
    EXPECT_EQ(packet.func(), func);
    EXPECT_EQ(packet.event, halide_trace_store);
    EXPECT_EQ(packet.parent_id, 5);
    ASSERT_EQ(packet.dimensions, 2);
    EXPECT_EQ(packet.coordinates()[1], -4);
    EXPECT_EQ(*static_cast<const int32_t*>(packet.value()), 77);
    at += packet.size;
  }
  EXPECT_EQ(at, bytes.size());
}

// Must be the first test in this file: the environment is read once.
TEST_F(HalideServices, TheEnvironmentNamesATraceFile) {
  const TemporaryFolder folder;
  const std::string path = folder.path() / "trace";
  setenv("HL_TRACE_FILE", path.c_str(), 1);
  trace("f");
  trace("g");
  EXPECT_GT(halide_get_trace_file(nullptr), 0);
  EXPECT_EQ(halide_shutdown_trace(), 0);
  unsetenv("HL_TRACE_FILE");
  EXPECT_EQ(prints, "");
  expect_packets(path, {"f", "g"});
  trace("h");
  EXPECT_EQ(prints, "Store h.0(3, -4) = 77\n");
}

TEST_F(HalideServices, ATraceFileMayBeADescriptor) {
  const TemporaryFolder folder;
  const std::string path = folder.path() / "trace";
  const int file = open(path.c_str(), O_WRONLY | O_CREAT, 0600);
  halide_set_trace_file(file);
  EXPECT_EQ(halide_get_trace_file(nullptr), file);
  trace("f");
  halide_set_trace_file(0);
  trace("g");
  expect_packets(path, {"f"});
  EXPECT_EQ(prints, "Store g.0(3, -4) = 77\n");
  EXPECT_EQ(close(file), 0) << "it is the program's own to close";
}

TEST_F(HalideServices, ATraceFileThatCannotBeWrittenIsToldOnce) {
  const int file = open("/dev/null", O_RDONLY);
  halide_set_trace_file(file);
  trace("f");
  trace("g");
  halide_set_trace_file(0);
  close(file);
  EXPECT_EQ(prints, "cannot write the trace: its file cannot be written\n");
}

// ---- copies ----

std::string error_text;

int copy(Buffer<int>& from, Buffer<int>& to) {
  halide_set_error_handler([](void*, const char* text) { error_text = text; });
  return halide_buffer_copy(nullptr, from.raw_buffer(), nullptr, to.raw_buffer());
}

TEST_F(HalideServices, ACopyTakesTheSameCoordinatesWhateverTheStrides) {
  Buffer<int> from(9, 7), planar(4, 3);
  from.set_min(-2, 5);
  from.for_each_element([&](int x, int y) { from(x, y) = 100 * y + x; });
  planar.set_min(1, 6);
  Buffer<int> turned = Buffer<int>(3, 4);
  turned.transpose(0, 1);
  turned.set_min(1, 6);
  EXPECT_EQ(copy(from, planar), 0);
  EXPECT_EQ(copy(from, turned), 0);
  EXPECT_TRUE(planar.host_dirty());
  int wrong = 0;
  planar.for_each_element(
      [&](int x, int y) { wrong += planar(x, y) != 100 * y + x || turned(x, y) != 100 * y + x; });
  EXPECT_EQ(wrong, 0);
}

TEST_F(HalideServices, ACopyThatDoesNotFitIsRefused) {
  Buffer<int> from(4), to(5), flat(4, 4), none(nullptr, 4);
  Buffer<float> other(4);
  EXPECT_EQ(copy(from, to), halide_error_code_access_out_of_bounds);
  EXPECT_NE(error_text.find("[0, 5), the source [0, 4)"), std::string::npos) << error_text;
  EXPECT_EQ(copy(from, flat), halide_error_code_bad_dimensions);
  EXPECT_EQ(copy(from, none), halide_error_code_host_is_null);
  EXPECT_EQ(halide_buffer_copy(nullptr, from, nullptr, other), halide_error_code_bad_type);
  EXPECT_EQ(halide_buffer_copy(nullptr, from, nullptr, nullptr), halide_error_code_buffer_is_null);
  from.set_device_dirty();
  EXPECT_EQ(copy(from, from), halide_error_code_no_device_interface);
}

int pools_released = 0;

TEST_F(HalideServices, DeviceMemoryIsKeptUnlessItIsForbidden) {
  static halide_device_allocation_pool pool = {[](void*) {
                                                 pools_released++;
                                                 return 0;
                                               },
                                               nullptr};
  halide_register_device_allocation_pool(&pool);
  EXPECT_TRUE(halide_can_reuse_device_allocations(nullptr));
  EXPECT_EQ(halide_reuse_device_allocations(nullptr, false), 0);
  EXPECT_FALSE(halide_can_reuse_device_allocations(nullptr));
  EXPECT_EQ(pools_released, 1);
  EXPECT_EQ(halide_reuse_device_allocations(nullptr, true), 0);
  EXPECT_EQ(pools_released, 1);
}

// ---- the profiler's state ----

TEST_F(HalideServices, TheProfilersStateListsPipelines) {
  retrograde_context context = {};
  void* run = retrograde_profiler_begin(&context, "services_pipeline", "overhead\nf");
  retrograde_profiler_memory(&context, run, 1, 640);
  retrograde_profiler_end(&context, run);
  halide_profiler_state* state = halide_profiler_get_state();
  ASSERT_NE(state, nullptr);
  EXPECT_EQ(state->sleep_time, 1);
  const halide_profiler_pipeline_stats* found = state->pipelines;
  while (found && std::string(found->name) != "services_pipeline")
    found = static_cast<const halide_profiler_pipeline_stats*>(found->next);
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->runs, 1);
  ASSERT_EQ(found->num_funcs, 2);
  EXPECT_STREQ(found->funcs[1].name, "f");
  EXPECT_EQ(found->funcs[1].memory_peak, 640u);
  EXPECT_EQ(found, halide_profiler_get_pipeline_state("services_pipeline"));
}

// ---- memoized results ----

const uint8_t key[] = {1, 2, 3};

int lookup(Buffer<int>& buffer, Buffer<float>& second) {
  halide_buffer_t* tuple[] = {buffer.raw_buffer(), second.raw_buffer()};
  return halide_memoization_cache_lookup(nullptr, key, sizeof key, buffer.raw_buffer(), 2, tuple);
}
void store(Buffer<int>& buffer, Buffer<float>& second, bool has_eviction_key = false) {
  halide_buffer_t* tuple[] = {buffer.raw_buffer(), second.raw_buffer()};
  EXPECT_EQ(halide_memoization_cache_store(nullptr, key, sizeof key, buffer.raw_buffer(), 2, tuple,
                                           has_eviction_key, 9),
            0);
}
void release(Buffer<int>& buffer, Buffer<float>& second) {
  for (halide_buffer_t* each : {buffer.raw_buffer(), second.raw_buffer()}) {
    halide_memoization_cache_release(nullptr, each->host);
    each->host = nullptr;
  }
}

// Buffers with a shape but no memory, as a lookup takes them.
struct Results {
  Buffer<int> a;
  Buffer<float> b;
  explicit Results(int min) : a(nullptr, 8, 3), b(nullptr, 8, 3) {
    for (halide_buffer_t* each : {a.raw_buffer(), b.raw_buffer()}) each->dim[0].min = min;
  }
  int look_up() { return lookup(a, b); }
  int* values() { return reinterpret_cast<int*>(a.raw_buffer()->host); }
  float* more_values() { return reinterpret_cast<float*>(b.raw_buffer()->host); }
  void compute(bool has_eviction_key = false) {
    for (int i = 0; i < 24; i++) {
      values()[i] = i * i;
      more_values()[i] = 0.5f * static_cast<float>(i);
    }
    store(a, b, has_eviction_key);
  }
  ~Results() { release(a, b); }
};

TEST_F(HalideServices, AStoredResultIsFound) {
  Results first(0);
  ASSERT_EQ(first.look_up(), 1);
  ASSERT_NE(first.values(), nullptr);
  first.compute();
  Results second(0);
  ASSERT_EQ(second.look_up(), 0);
  EXPECT_NE(second.values(), first.values());
  for (int i = 0; i < 24; i++) {
    ASSERT_EQ(second.values()[i], i * i);
    ASSERT_EQ(second.more_values()[i], 0.5f * static_cast<float>(i));
  }
  Results elsewhere(4);
  EXPECT_EQ(elsewhere.look_up(), 1) << "another region";
}

TEST_F(HalideServices, ResultsAreEvictedByKeyAndCleanedUp) {
  for (const bool cleans_up : {false, true}) {
    Results first(0);
    ASSERT_EQ(first.look_up(), 1);
    first.compute(true);
    cleans_up ? halide_memoization_cache_cleanup() : halide_memoization_cache_evict(nullptr, 9);
    Results second(0);
    EXPECT_EQ(second.look_up(), 1);
  }
}

TEST_F(HalideServices, ALookupWithoutMemoryFails) {
  static int blocks = 0;
  halide_set_custom_malloc([](void*, size_t bytes) -> void* {
    return blocks++ == 0 ? std::malloc(bytes) : nullptr;  // enough for one of the two
  });
  halide_set_custom_free([](void*, void* block) { std::free(block); });
  Results result(0);
  EXPECT_EQ(result.look_up(), -1);
  EXPECT_EQ(result.values(), nullptr);
}

// ---- parallel tasks ----

struct Pipe {
  halide_semaphore_t ready = {}, space = {};
  int value = 0, sum = 0, calls = 0;
  std::atomic<int> parallel_sum{0};
  int fail_at = -1;
};

int produce(void*, int min, int extent, uint8_t* closure, void*) {
  Pipe& pipe = *reinterpret_cast<Pipe*>(closure);
  EXPECT_EQ(extent, 1);
  if (min == pipe.fail_at) return -7;
  pipe.value = min;
  halide_semaphore_release(&pipe.ready, 1);
  return 0;
}
int consume(void*, int min, int, uint8_t* closure, void*) {
  Pipe& pipe = *reinterpret_cast<Pipe*>(closure);
  EXPECT_EQ(pipe.value, min);
  pipe.sum += pipe.value;
  halide_semaphore_release(&pipe.space, 1);
  return 0;
}
int add_in_parallel(void*, int min, int extent, uint8_t* closure, void* parent) {
  EXPECT_EQ(parent, closure);
  for (int i = min; i < min + extent; i++) reinterpret_cast<Pipe*>(closure)->parallel_sum += i;
  return 0;
}
int count_calls(void*, int min, int extent, uint8_t* closure, void*) {
  Pipe& pipe = *reinterpret_cast<Pipe*>(closure);
  pipe.calls++;
  EXPECT_EQ(min, 2);
  EXPECT_EQ(extent, 300);
  return 0;
}

int run_tasks(Pipe& pipe) {
  halide_semaphore_init(&pipe.ready, 0);
  halide_semaphore_init(&pipe.space, 1);
  auto* closure = reinterpret_cast<uint8_t*>(&pipe);
  halide_semaphore_acquire_t space{&pipe.space, 1}, ready{&pipe.ready, 1};
  // The consumer is listed first: it waits until the others have run.
  halide_parallel_task_t tasks[] = {
      {consume, closure, "consume", &ready, 1, 0, 500, 1, true},
      {produce, closure, "produce", &space, 1, 0, 500, 1, true},
      {add_in_parallel, closure, "add", nullptr, 0, 10, 100, 1, false},
      {count_calls, closure, "count", nullptr, 0, 2, 300, 1, true},
  };
  return halide_do_parallel_tasks(nullptr, 4, tasks, closure);
}

TEST_F(HalideServices, TasksWaitForEachOther) {
  for (int round = 0; round < 5; round++) {
    Pipe pipe;
    ASSERT_EQ(run_tasks(pipe), 0);
    EXPECT_EQ(pipe.sum, 500 * 499 / 2);
    EXPECT_EQ(pipe.parallel_sum, 100 * 10 + 100 * 99 / 2);
    EXPECT_EQ(pipe.calls, 1);
  }
}

TEST_F(HalideServices, ATaskThatFailsEndsThoseThatWait) {
  Pipe pipe;
  pipe.fail_at = 123;
  EXPECT_EQ(run_tasks(pipe), -7);
  EXPECT_EQ(pipe.sum, 123 * 122 / 2);
}

std::atomic<int> loop_tasks{0}, task_groups{0};

TEST_F(HalideServices, TheParallelRuntimeCanBeReplaced) {
  loop_tasks = task_groups = 0;
  halide_set_custom_parallel_runtime(
      nullptr, nullptr,
      [](void* context, halide_loop_task_t task, int min, int extent, uint8_t* closure,
         void* parent) {
        loop_tasks++;
        return halide_default_do_loop_task(context, task, min, extent, closure, parent);
      },
      [](void* context, int count, halide_parallel_task_t* tasks, void* parent) {
        task_groups++;
        return halide_default_do_parallel_tasks(context, count, tasks, parent);
      },
      nullptr, nullptr, nullptr);
  Pipe pipe;
  EXPECT_EQ(run_tasks(pipe), 0);
  halide_set_custom_parallel_runtime(nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr);
  EXPECT_EQ(task_groups, 1);
  EXPECT_EQ(loop_tasks, 500 + 500 + 100 + 1);
  EXPECT_EQ(run_tasks(pipe), 0);
  EXPECT_EQ(task_groups, 1);
}

}  // namespace
