// Generates the section of docs/gpu.md that schedules a convolution and compares it with the file: after each
// directive the loops and kernels as the compiler prints them, and the counts of the simulated device.
// RETROGRADE_UPDATE_GOLDEN=1 rewrites the section; read the difference before you commit it.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>
#include <sstream>
#include <tuple>

#include "ir/print.h"
#include "ir/visit.h"
#include "lower/lower.h"
#include "simt/simt_driver.h"
#include "support/simulated_device.h"

namespace retrograde {
namespace {

constexpr int width = 256, height = 128;

struct Convolution {
  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"};
  RDom r{0, 3, 0, 3, "r"};
  Func image{"image"}, sum{"sum"}, out{"out"};
  Convolution() {
    Buffer<float> in({width + 2, height + 2}, "in"), weights({3, 3}, "weights");
    in.for_each_element([&](int i, int j) { in(i, j) = static_cast<float>((i + 3 * j) % 8); });
    weights.fill(1.0f);
    image(x, y) = in(x, y);
    sum(x, y) += image(x + r.x, y + r.y) * weights(r.x, r.y);
    out(x, y) = sum(x, y);
  }
};

struct Step {
  const char *directive, *meaning;
  std::function<void(Convolution&)> give;
};

#define PLAIN(...) __VA_ARGS__
#define AS_TEXT(...) #__VA_ARGS__
#define STEP(directive, meaning)                                                      \
  {                                                                                   \
    AS_TEXT directive ";", meaning, [](Convolution&c) {                               \
      auto& [x, y, xi, yi, r, image, sum, out] = c;                                   \
      static_cast<void>(std::tie(x, y, xi, yi, r, image, sum, out)), PLAIN directive; \
    }                                                                                 \
  }

const std::vector<Step>& steps() {
  static const std::vector<Step> all = {
      STEP((out.gpu_tile(x, y, xi, yi, 32, 8)),
           "One block per tile of 32 x 8 points, one thread per point. Each thread computes the\n"
           "value of `sum` that its point needs and keeps it in registers."),
      STEP((sum.update().unroll(r.x).unroll(r.y)),
           "Replaces the two loops over the reduction by nine products in sequence. Device memory\n"
           "sees the same accesses."),
      STEP((image.compute_at(out, x).gpu_threads(x, y)),
           "The threads of a block copy the 34 x 10 points that the block reads into shared\n"
           "memory, wait at a barrier, and then read each point up to nine times. A block has as\n"
           "many threads as its largest stage needs; the surplus threads are idle while `out` is\n"
           "computed."),
      STEP((image.reorder_storage(y, x)),
           "A bad choice, for illustration: columns first in shared memory. Neighbours in x are\n"
           "then 10 words apart, so that pairs of threads of a warp access the same one of 32\n"
           "banks, which serves them one after the other."),
      STEP((image.align_storage(y, 11)),
           "Pads each column to 11 words. The number is odd, so that neighbours in a row no\n"
           "longer share a bank. The remaining conflicts are between rows: a row has 34 threads,\n"
           "more than a warp, so that a warp has threads of two rows."),
  };
  return all;
}

// The convolution with the directives of the first `count` steps.
Convolution scheduled(size_t count) {
  Convolution c;
  for (size_t i = 0; i < count; ++i) steps()[i].give(c);
  return c;
}

// ---- the contents of the page ----

// Removes the numbers of generated names, which count up within a process.
std::string without_numbers(const std::string& text) {
  return std::regex_replace(text, std::regex("\\.?\\$\\d+"), "");
}

std::string kernels_of(const Convolution& c) {
  const std::vector<graph::FuncPtr> outputs = Pipeline(c.out).spec().outputs;
  lower::LowerOptions options;
  options.target = with_gpu();
  const ir::LoweredFunction lowered =
      lower::lower("out", outputs, lower::infer_arguments(outputs), options);
  std::string text;
  ir::walk(lowered.body, [&](const ir::Launch& launch) { text += ir::print(Stmt(&launch)); });
  return text;
}

struct Counted {
  retrograde_simt_profile profile = {};
  int64_t copies = 0;  // to the device
};

Counted counted(Convolution& c) {
  const int64_t before = retrograde_simt_call_count("cuMemcpyHtoDAsync_v2");
  retrograde_simt_reset_profile();
  const Buffer<float> result = c.out.realize({width, height}, with_gpu());
  Counted counts;
  retrograde_simt_get_profile(nullptr, &counts.profile);
  counts.copies = retrograde_simt_call_count("cuMemcpyHtoDAsync_v2") - before;
  return counts;
}

std::string row(const std::string& what, const std::function<int64_t(const Counted&)>& of,
                const Counted* before, const Counted& after) {
  std::string first = before ? std::to_string(of(*before)) : "";
  return "| " + what + " | " + first + " | " + std::to_string(of(after)) + " |\n";
}

std::string table(const Counted* before, const Counted& after) {
  std::string text = "| | before | after |\n|---|---|---|\n";
  const auto add = [&](const char* what, int64_t retrograde_simt_profile::*field) {
    text += row(
        what, [=](const Counted& c) { return c.profile.*field; }, before, after);
  };
  using P = retrograde_simt_profile;
  add("launches", &P::launches);
  text += row(
      "copies to the device", [](const Counted& c) { return c.copies; }, before, after);
  add("threads", &P::threads);
  add("block barriers", &P::barriers);
  add("bytes of device memory accessed by threads", &P::global_bytes);
  add("32-byte sectors accessed", &P::global_sectors);
  add("32-byte sectors if the bytes of each request were dense", &P::ideal_sectors);
  add("shared-memory requests by warps", &P::shared_requests);
  add("bank conflicts (additional passes)", &P::bank_conflicts);
  return text;
}

std::string directives(size_t count) {
  std::string text;
  for (size_t i = 0; i < count; ++i) text += std::string(steps()[i].directive) + "\n";
  return text;
}

std::string section(size_t count, const Counted* before, Counted& after) {
  Convolution c = scheduled(count);
  after = counted(c);
  const Step& step = steps()[count - 1];
  std::ostringstream out;
  out << "### `" << std::string(step.directive).substr(0, std::string(step.directive).size() - 1)
      << "`\n\n"
      << step.meaning << "\n\n```cpp\n"
      << directives(count) << "```\n```text\n"
      << without_numbers(Pipeline(c.out).loop_nest(with_gpu())) << "```\n```text\n"
      << without_numbers(kernels_of(c)) << "```\n\n"
      << table(before, after) << "\n";
  return out.str();
}

constexpr const char* beginning =
    "<!-- from here on written by test/golden/gpu_page_test.cpp -->\n";
constexpr const char* end = "<!-- to here -->\n";

std::string written() {
  retrograde_simt_options options;
  retrograde_simt_get_options(&options);
  options.profile = 1;
  retrograde_simt_set_options(&options);
  std::ostringstream out;
  out << beginning << "\n```cpp\n"
      << "image(x, y) = in(x, y);\n"
      << "sum(x, y) += image(x + r.x, y + r.y) * weights(r.x, r.y);  // RDom r(0, 3, 0, 3)\n"
      << "out(x, y) = sum(x, y);\n```\n\nThe output has " << width << " x " << height
      << " points. Without directives the host computes it:\n\n```text\n"
      << without_numbers(Pipeline(scheduled(0).out).loop_nest(get_host_target()))
      << "```\n\nThe tables count one run on the simulated device.\n\n";
  Counted before, after;
  for (size_t count = 1; count <= steps().size(); ++count) {
    out << section(count, count > 1 ? &before : nullptr, after);
    before = after;
  }
  out << end;
  return out.str();
}

TEST(GpuPage, ShowsWhatTheCompilerDoes) {
  const std::string file = RETROGRADE_TEST_DIR "/../docs/gpu.md";
  std::ifstream in(file);
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  const size_t first = page.find(beginning), last = page.find(end);
  ASSERT_NE(first, std::string::npos);
  ASSERT_NE(last, std::string::npos);
  const std::string text = written();
  const std::string updated =
      page.substr(0, first) + text + page.substr(last + std::string(end).size());
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) {
    std::ofstream(file) << updated;
    return;
  }
  EXPECT_EQ(page, updated);
}

TEST(GpuPage, EveryStepComputesTheSame) {
  Buffer<float> expected = scheduled(0).out.realize({width, height}, get_host_target());
  for (size_t count = 1; count <= steps().size(); ++count) {
    Buffer<float> got = scheduled(count).out.realize({width, height}, with_gpu());
    for (size_t i = 0; i < got.number_of_elements(); ++i)
      ASSERT_EQ(got.data()[i], expected.data()[i]) << "step " << count << ", element " << i;
  }
}

}  // namespace
}  // namespace retrograde
