// The C runtime on its own: parallel loops, the pool, messages.
#include "retrograde_runtime.h"

#include <HalideRuntime.h>
#include <gtest/gtest.h>

#include <atomic>
#include <climits>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

namespace {

// A task from a callable with signature int(int).
template <typename F>
int parallel(retrograde_context* context, int min, int extent, F& body) {
  const auto task = [](retrograde_context*, int32_t index, uint8_t* closure) -> int32_t {
    return (*reinterpret_cast<F*>(closure))(index);
  };
  return retrograde_parallel_for(context, task, min, extent, reinterpret_cast<uint8_t*>(&body));
}

TEST(ParallelFor, RunsEveryIterationOnce) {
  for (int extent : {0, -5, 1, 2, 1000}) {
    std::vector<std::atomic<int>> seen(1000);
    auto body = [&](int index) {
      seen[static_cast<size_t>(index + 3)]++;
      return 0;
    };
    EXPECT_EQ(parallel(nullptr, -3, extent, body), 0);
    for (int i = 0; i < 1000; i++) EXPECT_EQ(seen[static_cast<size_t>(i)], i < extent ? 1 : 0);
  }
}

TEST(ParallelFor, ReachesTheEndsOfInt) {
  std::atomic<int64_t> sum{0};
  auto body = [&](int index) {
    sum += index;
    return 0;
  };
  EXPECT_EQ(parallel(nullptr, INT_MAX - 1, 2, body), 0);
  EXPECT_EQ(sum, int64_t{INT_MAX} * 2 - 1);
}

struct Report {
  int code;
  std::string message;
};

retrograde_context reporting_to(std::vector<Report>* reports) {
  retrograde_context context = {};
  context.user_data = reports;
  context.error_handler = [](retrograde_context* c, int code, const char* message) {
    static_cast<std::vector<Report>*>(c->user_data)->push_back({code, message});
  };
  return context;
}

TEST(ParallelFor, TheLowestFailureWinsAndIsToldOnce) {
  for (int repeat = 0; repeat < 50; repeat++) {
    std::vector<Report> reports;
    retrograde_context context = reporting_to(&reports);
    std::atomic<int> before{0};
    auto body = [&](int index) -> int {
      if (index < 400) before++;
      if (index < 400 || index % 3 != 1) return 0;
      return retrograde_report_error(&context, -100 - index, "iteration %i",
                                     static_cast<int64_t>(index));
    };
    EXPECT_EQ(parallel(&context, 0, 1000, body), -500);
    EXPECT_EQ(before, 400) << "iterations below the failing one must run";
    ASSERT_EQ(reports.size(), 1u);
    EXPECT_EQ(reports[0].code, -500);
    EXPECT_EQ(reports[0].message, "iteration 400");
  }
}

TEST(ParallelFor, FailuresOfInnerLoopsAreThoseOfTheirIteration) {
  for (int repeat = 0; repeat < 20; repeat++) {
    std::vector<Report> reports;
    retrograde_context context = reporting_to(&reports);
    auto outer = [&](int y) {
      auto inner = [&](int x) -> int {
        if (y * 20 + x < 137) return 0;
        return retrograde_report_error(&context, -1, "(%i, %i)", static_cast<int64_t>(x),
                                       static_cast<int64_t>(y));
      };
      return parallel(&context, 0, 20, inner);
    };
    EXPECT_EQ(parallel(&context, 0, 20, outer), -1);
    ASSERT_EQ(reports.size(), 1u);
    EXPECT_EQ(reports[0].message, "(17, 6)");
  }
}

TEST(ParallelFor, ObeysTheThreadLimit) {
  for (int limit : {1, 2}) {
    retrograde_context context = {};
    context.thread_limit = limit;
    std::atomic<int> running{0}, most{0};
    auto body = [&](int) {
      const int now = ++running;
      int seen = most;
      while (seen < now && !most.compare_exchange_weak(seen, now)) {
      }
      std::this_thread::yield();
      running--;
      return 0;
    };
    EXPECT_EQ(parallel(&context, 0, 500, body), 0);
    EXPECT_LE(most, limit);
  }
}

TEST(ParallelFor, CallersAreIndependent) {
  std::vector<std::thread> threads;
  std::vector<int> codes(4);
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([&, t] {
      retrograde_context context = {};
      context.thread_limit = 1 + t % 3;
      auto body = [&](int index) { return t % 2 && index >= 10 * t ? -t : 0; };
      for (int repeat = 0; repeat < 50; repeat++)
        codes[static_cast<size_t>(t)] = parallel(&context, 0, 100, body);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(codes, (std::vector<int>{0, -1, 0, -3}));
}

TEST(Memory, BlocksAreAlignedAndWritable) {
  for (int64_t bytes : {0, 1, 100, 70000, 20000000}) {
    void* block = retrograde_allocate(nullptr, bytes, 1);
    ASSERT_NE(block, nullptr);
    EXPECT_EQ(reinterpret_cast<uintptr_t>(block) % retrograde_allocation_alignment, 0u);
    std::memset(block, 1, static_cast<size_t>(bytes));
    retrograde_free(nullptr, block);
  }
  retrograde_free(nullptr, nullptr);
}

TEST(Memory, LargeBlocksAreUsedAgain) {
  retrograde_pool_release();
  void* first = retrograde_pool_malloc(1 << 20);
  retrograde_pool_free(first);
  EXPECT_GE(retrograde_pool_bytes(), size_t{1} << 20);
  void* other = retrograde_pool_malloc(4 << 20);  // too large for the free block
  EXPECT_NE(other, first);
  void* second = retrograde_pool_malloc(1000000);
  EXPECT_EQ(second, first);
  EXPECT_EQ(retrograde_pool_bytes(), 0u);
  retrograde_pool_free(second);
  retrograde_pool_free(other);
  retrograde_pool_release();
  EXPECT_EQ(retrograde_pool_bytes(), 0u);
}

TEST(Memory, ThePoolStaysBelowItsLimit) {
  retrograde_pool_release();
  retrograde_pool_set_limit(3 << 20);
  std::vector<void*> blocks;
  for (int i = 0; i < 8; i++) blocks.push_back(retrograde_pool_malloc(1 << 20));
  for (void* block : blocks) {
    retrograde_pool_free(block);
    EXPECT_LE(retrograde_pool_bytes(), size_t{3} << 20);
  }
  EXPECT_GT(retrograde_pool_bytes(), size_t{1} << 20);
  retrograde_pool_set_limit(0);
  EXPECT_EQ(retrograde_pool_bytes(), 0u);
  retrograde_pool_set_limit(size_t{1} << 30);
}

TEST(Memory, ThreadsShareThePool) {
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([t] {
      for (int i = 0; i < 200; i++) {
        const size_t bytes = static_cast<size_t>(100000 + 1000 * ((i * 7 + t) % 50));
        auto* block = static_cast<char*>(retrograde_pool_malloc(bytes));
        block[0] = static_cast<char>(t);
        block[bytes - 1] = static_cast<char>(t);
        ASSERT_EQ(block[0], block[bytes - 1]);
        retrograde_pool_free(block);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  retrograde_pool_release();
}

TEST(Memory, ImpossibleRequestsGiveNullAndAReason) {
  std::vector<Report> reports;
  retrograde_context context = reporting_to(&reports);
  EXPECT_EQ(retrograde_allocate(&context, -1, 4), nullptr);
  EXPECT_EQ(retrograde_allocate(&context, INT64_MAX, 4), nullptr);
  EXPECT_EQ(retrograde_allocate(&context, int64_t{INT32_MAX} + 1, 1), nullptr);
  EXPECT_EQ(retrograde_allocate(&context, INT32_MAX, INT32_MAX), nullptr);
  EXPECT_EQ(retrograde_allocation_error(&context, "f", -1, 4), retrograde_error_extents_negative);
  EXPECT_EQ(retrograde_allocation_error(&context, "f", INT64_MAX, 4),
            retrograde_error_allocation_too_large);
  EXPECT_EQ(retrograde_allocation_error(&context, "f", int64_t{INT32_MAX} + 1, 1),
            retrograde_error_allocation_too_large);
  EXPECT_EQ(retrograde_allocation_error(&context, "f", INT32_MAX, INT32_MAX),
            retrograde_error_out_of_memory);
  EXPECT_EQ(reports.size(), 4u);
  EXPECT_NE(reports[0].message.find("\"f\""), std::string::npos);
}

// ---- checks of buffer arguments ----

struct Image {
  halide_dimension_t dims[2] = {{3, 4, 1}, {-1, 5, 8}};
  uint8_t data[64] = {};
  halide_buffer_t buffer = {};
  Image() {
    buffer.host = data;
    buffer.type = halide_type_of<uint8_t>();
    buffer.dimensions = 2;
    buffer.dim = dims;
  }
};
constexpr int32_t uint8_word = 1 | 8 << 8 | 1 << 16, bool_word = 1 | 1 << 8 | 1 << 16;

TEST(BufferChecks, AShapeAsAskedForIsRight) {
  Image image;
  EXPECT_EQ(retrograde_check_shape(nullptr, &image.buffer, "im", uint8_word, 2), 0);
  image.dims[1].extent = 0;
  EXPECT_EQ(retrograde_check_shape(nullptr, &image.buffer, "im", uint8_word, 2), 0);
}

TEST(BufferChecks, WrongShapesAreNamed) {
  std::vector<Report> reports;
  retrograde_context context = reporting_to(&reports);
  Image image;
  const auto check = [&](const halide_buffer_t* buffer, int32_t type, int32_t dimensions) {
    return retrograde_check_shape(&context, buffer, "im", type, dimensions);
  };
  EXPECT_EQ(check(nullptr, uint8_word, 2), retrograde_error_buffer_argument_is_null);
  EXPECT_EQ(check(&image.buffer, bool_word, 2), retrograde_error_bad_type);
  EXPECT_NE(reports.back().message.find("of type bool, but its elements are of the kind 1"),
            std::string::npos)
      << reports.back().message;
  EXPECT_EQ(check(&image.buffer, uint8_word, 3), retrograde_error_bad_dimensions);
  image.dims[0].extent = -1;
  EXPECT_EQ(check(&image.buffer, uint8_word, 2), retrograde_error_extents_negative);
  image.dims[0].extent = image.dims[1].extent = 1 << 16;
  EXPECT_EQ(check(&image.buffer, uint8_word, 2), retrograde_error_extents_too_large);
  EXPECT_EQ(reports.size(), 5u);
}

TEST(BufferChecks, RegionsAreComparedWhereABitIsSet) {
  std::vector<Report> reports;
  retrograde_context context = reporting_to(&reports);
  const Image image;  // covers [3, 6] x [-1, 3]
  const auto check = [&](int32_t rules, int32_t dimensions, std::vector<int32_t> used) {
    return retrograde_check_region(&context, &image.buffer, "im", rules, 1, dimensions,
                                   used.data());
  };
  EXPECT_EQ(check(0, 0, {}), 0);
  EXPECT_EQ(check(0, 3, {3, 6, -1, 3}), 0);
  EXPECT_EQ(check(0, 2, {-1, 3}), 0);
  EXPECT_TRUE(reports.empty());
  EXPECT_EQ(check(0, 2, {-1, 4}), retrograde_error_access_out_of_bounds);
  EXPECT_NE(reports.back().message.find("is read over [-1, 4] in dimension 1"), std::string::npos);
  EXPECT_EQ(check(retrograde_region_is_written, 3, {2, 6, -1, 3}),
            retrograde_error_access_out_of_bounds);
  EXPECT_NE(reports.back().message.find("is written over [2, 6] in dimension 0"),
            std::string::npos);
}

TEST(BufferChecks, MemoryAndStridesAreChecked) {
  std::vector<Report> reports;
  retrograde_context context = reporting_to(&reports);
  const auto check = [&](const Image& image, int32_t rules, int32_t alignment) {
    return retrograde_check_region(&context, &image.buffer, "im", rules, alignment, 0, nullptr);
  };
  Image image;
  image.buffer.host = reinterpret_cast<uint8_t*>(uintptr_t{64});  // never read
  EXPECT_EQ(check(image, retrograde_region_is_dense, 64), 0);
  EXPECT_EQ(check(image, 0, 128), retrograde_error_unaligned_host_ptr);
  image.dims[0].stride = 2;
  EXPECT_EQ(check(image, 0, 1), 0);
  EXPECT_EQ(check(image, retrograde_region_is_dense, 1), retrograde_error_constraint_violated);
  for (int extent : {0, 1}) {  // there is no other element for the stride to reach
    for (int stride : {0, 2, -7, INT32_MIN}) {
      Image narrow = image;
      narrow.buffer.dim = narrow.dims;
      narrow.dims[0].extent = extent;
      narrow.dims[0].stride = stride;
      EXPECT_EQ(check(narrow, retrograde_region_is_dense, 1), 0) << extent << " " << stride;
    }
  }
  image.dims[1].stride = INT32_MIN;
  EXPECT_EQ(check(image, 0, 1), retrograde_error_allocation_too_large);
  image.dims[1].stride = 8;
  image.buffer.set_device_dirty(true);
  EXPECT_EQ(check(image, retrograde_region_is_written, 1), 0);
  EXPECT_EQ(check(image, 0, 1), retrograde_error_device_dirty_with_no_device_support);
  image.buffer.host = nullptr;
  EXPECT_EQ(check(image, 0, 1), retrograde_error_host_is_null);
  image.dims[0].extent = 0;
  image.buffer.set_device_dirty(false);
  EXPECT_EQ(check(image, 0, 1), 0);  // no elements, no memory
}

std::string formatted(size_t size, const char* format, auto... args) {
  std::vector<char> text(size + 1, '#');
  const size_t length = retrograde_format_message(text.data(), size, format, args...);
  EXPECT_EQ(text[length], 0);
  EXPECT_EQ(text[size], '#') << "wrote past the end";
  return std::string(text.data(), length);
}

TEST(Messages, FieldsAreFormatted) {
  EXPECT_EQ(formatted(200, "%i %u", int64_t{-7}, ~uint64_t{0}), "-7 18446744073709551615");
  EXPECT_EQ(formatted(200, "%f %g %f", 0.1, static_cast<double>(0.1f), 1e300), "0.1 0.1 1e+300");
  EXPECT_EQ(formatted(200, "%s%% %s", "ab", static_cast<const char*>(nullptr)), "ab% (null)");
  EXPECT_EQ(formatted(200, "%p", reinterpret_cast<const void*>(0x1f)), "0x1f");
}

TEST(Messages, LongTextIsCut) {
  EXPECT_EQ(formatted(5, "%s", "abcdefgh"), "abcd");
  EXPECT_EQ(formatted(1, "%s", "abcdefgh"), "");
  EXPECT_EQ(formatted(5, "abcdefgh"), "abcd");
}

TEST(Messages, CodesHaveNamesAndHalidesValues) {
  EXPECT_STREQ(retrograde_error_name(retrograde_error_out_of_memory), "out of memory");
  EXPECT_STREQ(retrograde_error_name(-12345), "unknown error");
  const std::pair<int, int> codes[] = {
      {retrograde_error_out_of_memory, halide_error_code_out_of_memory},
      {retrograde_error_access_out_of_bounds, halide_error_code_access_out_of_bounds},
      {retrograde_error_bad_type, halide_error_code_bad_type},
      {retrograde_error_bad_dimensions, halide_error_code_bad_dimensions},
      {retrograde_error_buffer_argument_is_null, halide_error_code_buffer_argument_is_null},
      {retrograde_error_requirement_failed, halide_error_code_requirement_failed},
      {retrograde_error_extents_negative, halide_error_code_buffer_extents_negative},
      {retrograde_error_extents_too_large, halide_error_code_buffer_extents_too_large},
      {retrograde_error_allocation_too_large, halide_error_code_buffer_allocation_too_large},
      {retrograde_error_host_is_null, halide_error_code_host_is_null},
      {retrograde_error_constraint_violated, halide_error_code_constraint_violated},
      {retrograde_error_param_too_small, halide_error_code_param_too_small},
      {retrograde_error_param_too_large, halide_error_code_param_too_large},
  };
  for (const auto& [ours, halides] : codes) EXPECT_EQ(ours, halides) << retrograde_error_name(ours);
}

}  // namespace
