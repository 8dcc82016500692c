// Calls functions compiled ahead of time from a program written only for Halide's headers. It links
// their objects and the static runtime, but not the compiler.
#include <HalideBuffer.h>
#include <HalideRuntime.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "aot_blur.h"
#include "aot_blur_context.h"
#include "aot_blur_mangled.h"
#include "aot_blur_no_query.h"
#include "aot_blur_swapped.h"
#include "aot_blur_unchecked.h"
#include "aot_scalars.h"
#include "aot_services.h"
#include "aot_table.h"
#include "aot_table_given.h"
#include "aot_talker.h"
#include "aot_tuple.h"
#include "aot_variants.h"

// Declared by later releases of the header.
extern "C" int halide_get_num_threads();

using Halide::Runtime::Buffer;

namespace {

std::mutex mutex;
std::vector<std::string> errors, prints;
std::vector<void*> contexts;

void keep_error(void* context, const char* message) {
  const std::lock_guard lock(mutex);
  contexts.push_back(context);
  errors.emplace_back(message);
}
void keep_print(void*, const char* text) {
  const std::lock_guard lock(mutex);
  prints.emplace_back(text);
}

class Aot : public testing::Test {
 protected:
  void SetUp() override {
    errors.clear();
    prints.clear();
    contexts.clear();
    halide_set_error_handler(keep_error);
    halide_set_custom_print(keep_print);
  }
  void TearDown() override {
    halide_set_error_handler(nullptr);
    halide_set_custom_print(nullptr);
    halide_set_custom_malloc(nullptr);
    halide_set_custom_free(nullptr);
    halide_set_custom_do_par_for(nullptr);
    halide_set_custom_do_task(nullptr);
    halide_set_custom_can_use_target_features(nullptr);
    halide_set_num_threads(0);
  }
  bool error_has(const std::string& text) {
    return errors.size() == 1 && errors[0].find(text) != std::string::npos;
  }
};

Buffer<uint8_t, 2> make_input() {
  Buffer<uint8_t, 2> in(66, 34);
  in.for_each_element([&](int x, int y) { in(x, y) = static_cast<uint8_t>(7 * x + 13 * y); });
  return in;
}

int expected(const Buffer<uint8_t, 2>& in, int x, int y, int offset) {
  int sum = 0;
  for (int dy = 0; dy < 3; dy++) {
    for (int dx = 0; dx < 3; dx++) sum += in(x + dx, y + dy);
  }
  return sum / 9 + offset;
}

void expect_blurred(const Buffer<uint8_t, 2>& in, const Buffer<uint16_t, 2>& out, int offset) {
  out.for_each_element(
      [&](int x, int y) { ASSERT_EQ(out(x, y), expected(in, x, y, offset)) << x << ", " << y; });
}

}  // namespace

// ---- calls ----

TEST_F(Aot, PlainCall) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  ASSERT_EQ(aot_blur(in, 5, out), 0);
  expect_blurred(in, out, 5);
}

TEST_F(Aot, ArgumentsStandInTheListedOrder) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  ASSERT_EQ(aot_blur_swapped(5, in, out), 0);
  expect_blurred(in, out, 5);
}

TEST_F(Aot, MangledNameInNamespaces) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  ASSERT_EQ(space::inner::aot_blur_mangled(in, 5, out), 0);
  expect_blurred(in, out, 5);
  EXPECT_STREQ(space::inner::aot_blur_mangled_metadata()->name, "aot_blur_mangled");
  int offset = 6;
  void* args[] = {in.raw_buffer(), &offset, out.raw_buffer()};
  ASSERT_EQ(space::inner::aot_blur_mangled_argv(args), 0);
  expect_blurred(in, out, 6);
}

TEST_F(Aot, ArgvCall) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  int offset = 9;
  void* args[] = {in.raw_buffer(), &offset, out.raw_buffer()};
  ASSERT_EQ(aot_blur_argv(args), 0);
  expect_blurred(in, out, 9);
}

TEST_F(Aot, ScalarsOfEveryType) {
  Buffer<double, 1> out(11);
  int pointee = 0;
  const uint64_t large = (uint64_t{1} << 63) + (uint64_t{1} << 40);
  ASSERT_EQ(aot_scalars(true, -100, 200, -30000, 60000, -2000000000, 4000000000u, -(1LL << 60),
                        large, 1.5f, -2.25, &pointee, out),
            0);
  const double wanted[] = {1,
                           -100,
                           200,
                           -30000,
                           60000,
                           -2000000000.0,
                           4e9,
                           -std::ldexp(1, 60),
                           static_cast<double>(large),
                           1.5,
                           -2.25};
  for (int i = 0; i < 11; i++) EXPECT_EQ(out(i), wanted[i]) << i;
}

TEST_F(Aot, ScalarsOfEveryTypeThroughArgv) {
  Buffer<double, 1> out(11);
  bool b = false;
  int8_t i8 = -1;
  uint8_t u8 = 255;
  int16_t i16 = -1;
  uint16_t u16 = 65535;
  int32_t i32 = -1;
  uint32_t u32 = 4294967295u;
  int64_t i64 = -1;
  uint64_t u64 = 3;
  float f32 = -0.5f;
  double f64 = 1e300;
  void* handle = nullptr;
  void* args[] = {
      &b, &i8, &u8, &i16, &u16, &i32, &u32, &i64, &u64, &f32, &f64, &handle, out.raw_buffer()};
  ASSERT_EQ(aot_scalars_argv(args), 0);
  const double wanted[] = {0, -1, 255, -1, 65535, -1, 4294967295.0, -1, 3, -0.5, 1e300};
  for (int i = 0; i < 11; i++) EXPECT_EQ(out(i), wanted[i]) << i;
}

TEST_F(Aot, TuplesHaveOneBufferForEachValue) {
  Buffer<float, 1> in(16), first(16);
  Buffer<int32_t, 1> second(16);
  for (int i = 0; i < 16; i++) in(i) = 0.5f * static_cast<float>(i);
  ASSERT_EQ(aot_tuple(in, first, second), 0);
  for (int i = 0; i < 16; i++) {
    EXPECT_EQ(first(i), in(i) + 1.0f);
    EXPECT_EQ(second(i), i);
  }
  EXPECT_EQ(aot_tuple_metadata()->num_arguments, 3);
}

TEST_F(Aot, TableIsInTheCodeUnlessItIsAnArgument) {
  Buffer<float, 2> out(4, 3), table(4, 3);
  out.set_min(-1, 2);
  ASSERT_EQ(aot_table(out), 0);
  out.for_each_element(
      [&](int x, int y) { EXPECT_EQ(out(x, y), 2.0f * static_cast<float>(10 * (y - 2) + x + 1)); });
  EXPECT_EQ(aot_table_metadata()->num_arguments, 1);
  table.set_min(-1, 2);
  table.fill(4.0f);
  ASSERT_EQ(aot_table_given(table, out), 0);
  out.for_each_value([](float value) { EXPECT_EQ(value, 8.0f); });
}

TEST_F(Aot, SeveralThreadsMayCallAtOnce) {
  Buffer<uint8_t, 2> in = make_input();
  std::vector<std::thread> threads;
  std::atomic<int> failures{0};
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([&] {
      for (int i = 0; i < 20; i++) {
        Buffer<uint16_t, 2> out(64, 32);
        if (aot_blur(in, i, out) != 0 || out(3, 4) != expected(in, 3, 4, i)) failures++;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failures, 0);
}

// ---- bounds queries ----

TEST_F(Aot, QueryFillsInTheBoundsOfTheInput) {
  Buffer<uint8_t, 2> in(nullptr, 0, 0);
  Buffer<uint16_t, 2> out(64, 32);
  out.set_min(10, -4);
  ASSERT_EQ(aot_blur(in, 5, out), 0);
  EXPECT_EQ(in.dim(0).min(), 10);
  EXPECT_EQ(in.dim(0).extent(), 66);
  EXPECT_EQ(in.dim(1).min(), -4);
  EXPECT_EQ(in.dim(1).extent(), 34);
  EXPECT_EQ(in.dim(1).stride(), 66);
  in.allocate();
  in.fill(9);
  ASSERT_EQ(aot_blur(in, 5, out), 0);
  EXPECT_EQ(out(20, 5), 14);
}

TEST_F(Aot, WithoutBoundsQueriesANullHostIsAnError) {
  Buffer<uint8_t, 2> in = make_input(), query(nullptr, 0, 0);
  Buffer<uint16_t, 2> out(64, 32);
  ASSERT_EQ(aot_blur_no_query(in, 5, out), 0);
  expect_blurred(in, out, 5);
  EXPECT_NE(aot_blur_no_query(query, 5, out), 0);
  EXPECT_EQ(query.dim(0).extent(), 0);
}

// ---- metadata ----

TEST_F(Aot, MetadataDescribesTheFunction) {
  const halide_filter_metadata_t* metadata = aot_blur_metadata();
  EXPECT_EQ(metadata->version, 1);
  EXPECT_STREQ(metadata->name, "aot_blur");
  EXPECT_NE(std::string(metadata->target).find("-64-linux"), std::string::npos);
  ASSERT_EQ(metadata->num_arguments, 3);
  const halide_filter_argument_t &in = metadata->arguments[0], &offset = metadata->arguments[1],
                                 &out = metadata->arguments[2];
  EXPECT_STREQ(in.name, "in");
  EXPECT_EQ(in.kind, halide_argument_kind_input_buffer);
  EXPECT_EQ(in.dimensions, 2);
  EXPECT_EQ(in.type, halide_type_t(halide_type_uint, 8));
  ASSERT_NE(in.buffer_estimates, nullptr);
  EXPECT_EQ(*in.buffer_estimates[0], 0);
  EXPECT_EQ(*in.buffer_estimates[1], 640);
  EXPECT_EQ(*in.buffer_estimates[2], -1);
  EXPECT_EQ(*in.buffer_estimates[3], 480);
  EXPECT_STREQ(offset.name, "offset");
  EXPECT_EQ(offset.kind, halide_argument_kind_input_scalar);
  EXPECT_EQ(offset.type, halide_type_t(halide_type_int, 32));
  EXPECT_EQ(offset.scalar_def->u.i32, 3);
  EXPECT_EQ(offset.scalar_min->u.i32, -5);
  EXPECT_EQ(offset.scalar_max->u.i32, 100);
  EXPECT_EQ(offset.scalar_estimate->u.i32, 7);
  EXPECT_EQ(out.kind, halide_argument_kind_output_buffer);
  EXPECT_EQ(out.type, halide_type_t(halide_type_uint, 16));
  EXPECT_EQ(out.buffer_estimates, nullptr);
}

// ---- errors ----

TEST_F(Aot, WrongElementType) {
  Buffer<int16_t, 2> in(66, 34);
  Buffer<uint16_t, 2> out(64, 32);
  EXPECT_EQ(aot_blur(in, 5, out), halide_error_code_bad_type);
  EXPECT_TRUE(error_has("\"in\" must have elements of type"));
  EXPECT_TRUE(error_has("of the kind 0 (0: int"));
  EXPECT_TRUE(error_has("with 16 bits"));
}

TEST_F(Aot, WrongDimensions) {
  Buffer<uint8_t, 3> in(66, 34, 2);
  Buffer<uint16_t, 2> out(64, 32);
  EXPECT_EQ(aot_blur(in, 5, out), halide_error_code_bad_dimensions);
  EXPECT_TRUE(error_has("\"in\" must have 2 dimensions"));
}

TEST_F(Aot, TooSmallInput) {
  Buffer<uint8_t, 2> in(65, 34);
  Buffer<uint16_t, 2> out(64, 32);
  EXPECT_EQ(aot_blur(in, 5, out), halide_error_code_access_out_of_bounds);
  EXPECT_TRUE(error_has("\"in\" is read over [0, 65] in dimension 0"));
}

TEST_F(Aot, NullBuffer) {
  Buffer<uint16_t, 2> out(64, 32);
  EXPECT_EQ(aot_blur(nullptr, 5, out), halide_error_code_buffer_argument_is_null);
  EXPECT_TRUE(error_has("\"in\" is null"));
}

TEST_F(Aot, ParameterBeyondItsLimit) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  EXPECT_EQ(aot_blur(in, 101, out), halide_error_code_param_too_large);
  EXPECT_TRUE(error_has("\"offset\" is 101"));
}

TEST_F(Aot, WithoutAssertsNothingIsChecked) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  EXPECT_EQ(aot_blur_unchecked(in, 101, out), 0);
  expect_blurred(in, out, 101);
}

TEST_F(Aot, RequirementThatFails) {
  Buffer<int32_t, 1> out(6);
  EXPECT_EQ(aot_talker(4, out), halide_error_code_requirement_failed);
  EXPECT_TRUE(error_has("too far: 4"));
}

TEST_F(Aot, FailingAllocation) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  halide_set_custom_malloc([](void*, size_t) -> void* { return nullptr; });
  EXPECT_EQ(aot_blur(in, 5, out), halide_error_code_out_of_memory);
  EXPECT_TRUE(error_has("cannot allocate \"rows\""));
}

// ---- handlers ----

TEST_F(Aot, PrintGoesToTheHandler) {
  Buffer<int32_t, 1> out(2);
  ASSERT_EQ(aot_talker(4, out), 0);
  ASSERT_EQ(prints.size(), 2u);
  EXPECT_EQ(prints[0], "0 of 4\n");
}

static std::atomic<int> allocations{0}, releases{0};

TEST_F(Aot, MemoryComesFromTheHandlers) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  // The weakest alignment that malloc may return.
  halide_set_custom_malloc([](void*, size_t bytes) -> void* {
    allocations++;
    return static_cast<char*>(malloc(bytes + 8)) + 8;
  });
  halide_set_custom_free([](void*, void* block) {
    releases++;
    free(static_cast<char*>(block) - 8);
  });
  ASSERT_EQ(aot_blur(in, 5, out), 0);
  expect_blurred(in, out, 5);
  EXPECT_EQ(allocations, 1);
  EXPECT_EQ(releases, 1);
}

static std::atomic<int> loops{0}, tasks{0};

TEST_F(Aot, ParallelLoopsGoToTheHandler) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  halide_set_custom_do_par_for(
      [](void* context, halide_task_t task, int min, int size, uint8_t* closure) {
        loops++;
        for (int i = min + size; i-- > min;) {
          if (const int code = task(context, i, closure)) return code;
        }
        return 0;
      });
  ASSERT_EQ(aot_blur(in, 5, out), 0);
  expect_blurred(in, out, 5);
  EXPECT_EQ(loops, 2);
}

TEST_F(Aot, TasksGoToTheHandler) {
  Buffer<uint8_t, 2> in = make_input();
  Buffer<uint16_t, 2> out(64, 32);
  halide_set_custom_do_task([](void* context, halide_task_t task, int index, uint8_t* closure) {
    tasks++;
    return task(context, index, closure);
  });
  ASSERT_EQ(aot_blur(in, 5, out), 0);
  EXPECT_EQ(tasks, 34 + 32);
}

TEST_F(Aot, ThreadsCanBeCountedAndEnded) {
  Buffer<uint8_t, 2> in = make_input();
  halide_set_num_threads(3);
  EXPECT_EQ(halide_get_num_threads(), 3);
  EXPECT_EQ(halide_set_num_threads(5), 3);
  for (int i = 0; i < 3; i++) {
    Buffer<uint16_t, 2> out(64, 32);
    ASSERT_EQ(aot_blur(in, 5, out), 0);
    expect_blurred(in, out, 5);
    halide_shutdown_thread_pool();
  }
}

TEST_F(Aot, UserContextReachesTheHandlers) {
  Buffer<uint8_t, 2> in(65, 34);
  Buffer<uint16_t, 2> out(64, 32);
  int mine = 0;
  EXPECT_EQ(aot_blur_context(&mine, in, 5, out), halide_error_code_access_out_of_bounds);
  ASSERT_EQ(contexts.size(), 1u);
  EXPECT_EQ(contexts[0], &mine);
  ASSERT_EQ(aot_blur_context_metadata()->num_arguments, 4);
  EXPECT_STREQ(aot_blur_context_metadata()->arguments[0].name, "__user_context");
  Buffer<uint8_t, 2> good = make_input();
  void* context = &mine;
  int offset = 2;
  void* args[] = {&context, good.raw_buffer(), &offset, out.raw_buffer()};
  ASSERT_EQ(aot_blur_context_argv(args), 0);
  expect_blurred(good, out, 2);
}

// ---- several targets ----

static uint64_t allowed_feature = 0;

static int allow_one(int count, const uint64_t* features) {
  for (int word = 0; word < count; word++) {
    for (int bit = 0; bit < 64; bit++) {
      const int feature = 64 * word + bit;
      const bool is_vector =
          feature == halide_target_feature_avx2 || feature == halide_target_feature_avx512_skylake;
      if ((features[word] >> bit & 1) && is_vector &&
          static_cast<uint64_t>(feature) > allowed_feature) {
        return 0;
      }
    }
  }
  return halide_default_can_use_target_features(count, features);
}

TEST_F(Aot, VariantsAreChosenByTheProcessorsFeatures) {
  Buffer<float, 1> in(40), out(40);
  in.fill(0.0f);
  ASSERT_EQ(aot_variants(in, out), 0);
  const float best = out(0);
  EXPECT_EQ(out(39), best);
  EXPECT_STREQ(aot_variants_metadata()->name, "aot_variants");
#if defined(__x86_64__)
  EXPECT_EQ(best, __builtin_cpu_supports("avx512vl") ? 16.0f
                  : __builtin_cpu_supports("avx2")   ? 8.0f
                                                     : 4.0f);
  halide_set_custom_can_use_target_features(allow_one);
  allowed_feature = halide_target_feature_avx2;
  ASSERT_EQ(aot_variants(in, out), 0);
  EXPECT_EQ(out(0), __builtin_cpu_supports("avx2") ? 8.0f : 4.0f);
  allowed_feature = halide_target_feature_sse41;
  ASSERT_EQ(aot_variants(in, out), 0);
  EXPECT_EQ(out(0), 4.0f);
#endif
}

// ---- registration ----

static std::map<std::string, int (*)(void**)>& registered() {
  static std::map<std::string, int (*)(void**)> functions;
  return functions;
}
extern "C" void halide_register_argv_and_metadata(int (*argv)(void**),
                                                  const halide_filter_metadata_t* metadata,
                                                  const char* const*) {
  registered()[metadata->name] = argv;
}

TEST_F(Aot, RegistrationTellsTheProgram) {
  ASSERT_EQ(registered().count("aot_blur"), 1u);
  EXPECT_EQ(registered()["aot_blur"], aot_blur_argv);
}

// ---- the rest of the runtime ----

static std::atomic<int> traced_stores{0};

TEST_F(Aot, TracesMemoizedAndAsynchronousStages) {
  Buffer<int32_t, 1> out(8);
  halide_memoization_cache_set_size(1 << 20);
  halide_set_custom_trace([](void*, const halide_trace_event_t* event) {
    if (event->event == halide_trace_store) traced_stores++;
    return 1;
  });
  for (int call = 1; call <= 2; call++) {
    ASSERT_EQ(aot_services(1, out), 0);
    for (int i = 0; i < 8; i++) EXPECT_EQ(out(i), 2 * (i * i + (i + 1) * (i + 1) + 2));
    EXPECT_EQ(traced_stores, 8 * call);
  }
  halide_set_custom_trace(nullptr);
  ASSERT_EQ(aot_services(1, out), 0);
  EXPECT_FALSE(prints.empty());  // the default trace is text
  halide_memoization_cache_cleanup();
}

TEST_F(Aot, HalideMutexesExclude) {
  static halide_mutex lock = {};
  static int count = 0;
  std::vector<halide_thread*> threads;
  for (int t = 0; t < 4; t++) {
    threads.push_back(halide_spawn_thread(
        [](void*) {
          for (int i = 0; i < 1000; i++) {
            halide_mutex_lock(&lock);
            count++;
            halide_mutex_unlock(&lock);
          }
        },
        nullptr));
  }
  for (halide_thread* thread : threads) halide_join_thread(thread);
  EXPECT_EQ(count, 4000);
}

TEST_F(Aot, HalideConditionsWake) {
  static halide_mutex lock = {};
  static halide_cond changed = {};
  static bool ready = false;
  halide_thread* thread = halide_spawn_thread(
      [](void*) {
        halide_mutex_lock(&lock);
        ready = true;
        halide_cond_signal(&changed);
        halide_mutex_unlock(&lock);
      },
      nullptr);
  halide_mutex_lock(&lock);
  while (!ready) halide_cond_wait(&changed, &lock);
  halide_mutex_unlock(&lock);
  halide_join_thread(thread);
  EXPECT_TRUE(ready);
}

TEST_F(Aot, HalfPrecisionBits) {
  EXPECT_EQ(halide_float16_bits_to_float(0x3c00), 1.0f);
  EXPECT_EQ(halide_float16_bits_to_float(0xc500), -5.0f);
  EXPECT_EQ(halide_float16_bits_to_double(0x0001), std::ldexp(1.0, -24));
  EXPECT_TRUE(std::isinf(halide_float16_bits_to_double(0x7c00)));
  EXPECT_TRUE(std::isnan(halide_float16_bits_to_double(0x7e00)));
}
