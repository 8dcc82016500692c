// Pipeline::auto_schedule for a GPU, on the simulated device: unscheduled programs and gradients
// become kernels, each launched once per run, and give the CPU's results.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <regex>

#include "graph/directives/schedule_log.h"
#include "graph/graph.h"
#include "simt/simt_driver.h"
#include "support/gpu_programs.h"
#include "support/simulated_device.h"

namespace retrograde {
namespace {

void set_order(int order) {
  retrograde_simt_options options;
  retrograde_simt_get_options(&options);
  options.order = order;
  retrograde_simt_set_options(&options);
}

// Outputs of floats or integers, and their sizes.
struct Program {
  std::vector<Func> outputs;
  std::vector<std::vector<int>> sizes;

  void estimate() {
    for (size_t i = 0; i < outputs.size(); ++i) {
      for (size_t d = 0; d < sizes[i].size(); ++d)
        outputs[i].set_estimate(outputs[i].args()[d], 0, sizes[i][d]);
    }
  }
  std::vector<std::vector<double>> run(const Target& target) {
    std::vector<Buffer<>> buffers;
    for (size_t i = 0; i < outputs.size(); ++i) {
      for (const Type& type : outputs[i].types()) buffers.emplace_back(type, sizes[i]);
    }
    Pipeline(outputs).realize(Realization(buffers), target);
    std::vector<std::vector<double>> values;
    for (Buffer<>& buffer : buffers) {
      buffer.copy_to_host();
      values.push_back(values_of(buffer));
    }
    return values;
  }

 private:
  static std::vector<double> values_of(const Buffer<>& buffer) {
    if (buffer.type() == Float(32)) return as_doubles<float>(buffer);
    if (buffer.type() == Float(64)) return as_doubles<double>(buffer);
    return as_doubles<int32_t>(buffer);
  }
  template <typename T>
  static std::vector<double> as_doubles(const Buffer<T>& typed) {
    return {typed.data(), typed.data() + typed.number_of_elements()};
  }
};

struct Case {
  std::string name;
  std::function<Program()> build;
  bool is_exact = false;  // no sum is reordered, and no product and sum may become an FMA
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

Var x("x"), y("y"), c("c");

Buffer<float> picture(int width, int height, int channels = 0) {
  std::vector<int> sizes{width, height};
  if (channels > 0) sizes.push_back(channels);
  Buffer<float> image(sizes);
  int i = 0;
  image.for_each_value([&](float& value) { value = static_cast<float>((37 * i++) % 101) / 101; });
  return image;
}

// A loss of the result of `make` on an image, and its gradient by the image.
Program gradient_of(const std::function<Func(Func)>& make, int width, int height) {
  const Buffer<float> in = picture(width, height);
  Func image("image"), loss("loss");
  image(x, y) = in(x, y);
  const Func made = make(BoundaryConditions::repeat_edge(image, {{0, width}, {0, height}}));
  RDom all(0, width, 0, height, "all");
  const Expr value = made(all.x, all.y) - 0.25f;
  loss() = 0.0f;
  loss() += value * value;
  const Derivative d = propagate_adjoints(loss);
  return {{loss, d(image)}, {{}, {width, height}}};
}

Program convolution_with_bias() {
  const Buffer<float> in = picture(66, 34), start = picture(3, 3);
  Func weights("weights"), bias("bias"), filtered("filtered"), loss("loss");
  RDom r(0, 3, 0, 3, "r"), all(0, 64, 0, 32, "all");
  weights(x, y) = start(x, y);
  bias() = 0.5f;
  filtered(x, y) = bias();
  filtered(x, y) += in(x + r.x, y + r.y) * weights(r.x, r.y);
  loss() = 0.0f;
  loss() += filtered(all.x, all.y) * filtered(all.x, all.y);
  const Derivative d = propagate_adjoints(loss);
  return {{loss, d(weights), d(bias)}, {{}, {3, 3}, {}}};
}

Program warp() {
  const Buffer<float> flow = picture(48, 40);
  return gradient_of(
      [&](const Func& image) {
        Func warped("warped");
        const Expr px = cast<float>(x) + 5.0f * flow(x, y), left = floor(px);
        const Expr at = clamp(cast<int>(left), 0, 46), part = px - left;
        warped(x, y) = (1.0f - part) * image(at, y) + part * image(at + 1, y);
        return warped;
      },
      48, 40);
}

Program gather() {
  const Buffer<float> values = picture(50, 3);
  Buffer<int32_t> places(4000);
  for (int i = 0; i < 4000; ++i) places(i) = (i * 31) % 50;
  Func table("table"), loss("loss");
  RDom r(0, 4000, "r");
  table(x, y) = values(x, y);
  loss() = 0.0f;
  loss() += table(clamp(places(r), 0, 49), 1) * table(clamp(places(r), 0, 49), 2);
  return {{loss, propagate_adjoints(loss)(table)}, {{}, {50, 3}}};
}

// Counts and sums: how often each bin occurs, and the sum of its values.
Program histogram() {
  const Buffer<float> in = picture(120, 90);
  Func counts("counts"), sums("sums");
  RDom r(0, 120, 0, 90, "r");
  const Expr bin = clamp(cast<int>(in(r.x, r.y) * 32), 0, 31);
  counts(x) = 0;
  counts(x) = counts(x);
  counts(bin) += 1;
  sums(x) = 0.0f;
  sums(bin) += in(r.x, r.y);
  return {{counts, sums}, {{32}, {32}}};
}

Program counts_alone() {
  Program program = histogram();
  return {{program.outputs[0]}, {{32}}};
}

Program filter_forth_and_back() {
  return gradient_of(
      [](const Func& image) {
        Func out("out");
        RDom forth(1, 47, "forth"), back(1, 47, "back");
        out(x, y) = image(x, y);
        out(forth, y) = 0.6f * out(forth - 1, y) + 0.4f * image(forth, y);
        out(47 - back, y) = 0.6f * out(48 - back, y) + 0.4f * out(47 - back, y);
        return out;
      },
      48, 30);
}

Program matrix_product() {
  const Buffer<float> a = picture(40, 40), b = picture(40, 40);
  Func left("left"), product("product"), loss("loss");
  RDom r(0, 40, "r"), all(0, 40, 0, 40, "all");
  left(x, y) = a(x, y);
  product(x, y) = 0.0f;
  product(x, y) += left(r, y) * b(x, r);
  loss() = 0.0f;
  loss() += product(all.x, all.y) * product(all.x, all.y);
  return {{loss, propagate_adjoints(loss)(left)}, {{}, {40, 40}}};
}

Program separable_blur() {
  return gradient_of(
      [](const Func& image) {
        Func rows("rows"), blurred("blurred");
        rows(x, y) = (image(x - 1, y) + 2.0f * image(x, y) + image(x + 1, y)) / 4.0f;
        blurred(x, y) = (rows(x, y - 1) + 2.0f * rows(x, y) + rows(x, y + 1)) / 4.0f;
        return blurred;
      },
      60, 40);
}

Program tone_curve() {
  const Buffer<float> in = picture(80, 50);
  Func gamma("gamma"), loss("loss");
  RDom all(0, 80, 0, 50, "all");
  gamma() = 1.2f;
  loss() = 0.0f;
  loss() += pow(in(all.x, all.y) + 0.5f, gamma());
  return {{loss, propagate_adjoints(loss)(gamma)}, {{}, {}}};
}

Program sum_of_many() {
  Buffer<float> in(100000);
  for (int i = 0; i < 100000; ++i) in(i) = static_cast<float>(i % 1000) / 1024;
  Func image("image"), loss("loss");
  RDom r(0, 100000, "r");
  image(x) = in(x);
  loss() = 0.0f;
  loss() += image(r) * image(r);
  return {{loss, propagate_adjoints(loss)(image)}, {{}, {100000}}};
}

Program planes_and_tuples() {
  const Buffer<float> in = picture(40, 30, 3);
  Func both("both"), sums("sums"), rows("rows");
  RDom r(0, 30, "r");
  both(x, y, c) = Tuple(in(x, y, c) * 2.0f, cast<int>(in(x, y, c) * 255.0f));
  sums(x, c) = Tuple(0.0f, 0);
  sums(x, c) = Tuple(sums(x, c)[0] + both(x, r, c)[0], sums(x, c)[1] + both(x, r, c)[1]);
  rows(x, y) = both(x, y, 0)[0] + both(x, y, 2)[0];
  return {{both, sums, rows}, {{40, 30, 3}, {40, 3}, {40, 30}}};
}

Program down_and_up() {
  return gradient_of(
      [](const Func& image) {
        Func small("small"), large("large");
        small(x, y) = (image(2 * x, 2 * y) + image(2 * x + 1, 2 * y) + image(2 * x, 2 * y + 1) +
                       image(2 * x + 1, 2 * y + 1)) /
                      4.0f;
        large(x, y) = 0.75f * small(x / 2, y / 2) + 0.25f * small((x + 1) / 2, (y + 1) / 2);
        return large;
      },
      44, 36);
}

// Velocities advect a density, and a few sweeps make them divergence-free.
Program fluid_step() {
  return gradient_of(
      [](const Func& density) {
        std::vector<Func> pressure;
        Func source("source"), moved("moved");
        source(x, y) =
            density(x + 1, y) - density(x - 1, y) + density(x, y + 1) - density(x, y - 1);
        pressure.emplace_back("start");
        pressure.back()(x, y) = 0.0f;
        for (int i = 0; i < 4; ++i) {
          const Func last = BoundaryConditions::repeat_edge(pressure.back(), {{0, 32}, {0, 24}});
          Func next("pressure" + std::to_string(i));
          next(x, y) =
              (last(x - 1, y) + last(x + 1, y) + last(x, y - 1) + last(x, y + 1) - source(x, y)) /
              4.0f;
          pressure.push_back(next);
        }
        const Func& p = pressure.back();
        const Expr px = cast<float>(x) - (p(min(x + 1, 31), y) - p(max(x - 1, 0), y));
        const Expr at = clamp(cast<int>(floor(px)), 0, 30),
                   part = clamp(px - floor(px), 0.0f, 1.0f);
        moved(x, y) = (1.0f - part) * density(at, y) + part * density(at + 1, y);
        return moved;
      },
      32, 24);
}

std::vector<Case> cases() {
  std::vector<Case> all{{"convolution_with_bias", convolution_with_bias},
                        {"warp", warp},
                        {"gather", gather},
                        {"histogram", histogram},
                        {"counts", counts_alone, true},
                        {"filter_forth_and_back", filter_forth_and_back},
                        {"matrix_product_gradient", matrix_product},
                        {"separable_blur_gradient", separable_blur},
                        {"tone_curve_gradient", tone_curve},
                        {"sum_of_many", sum_of_many},
                        {"planes_and_tuples", planes_and_tuples},
                        {"down_and_up", down_and_up},
                        {"fluid_step", fluid_step}};
  for (const gpu_programs::Program& program : gpu_programs::all()) {
    all.push_back({program.name, [program] {
                     return Program{{program.build(false)}, {program.sizes}};
                   }});
  }
  return all;
}

void expect_close(const std::vector<std::vector<double>>& got,
                  const std::vector<std::vector<double>>& expected, bool is_exact) {
  ASSERT_EQ(got.size(), expected.size());
  for (size_t i = 0; i < got.size(); ++i) {
    ASSERT_EQ(got[i].size(), expected[i].size());
    double largest = 0;
    bool is_rounded = true;
    for (const double value : expected[i]) {
      largest = std::max(largest, std::abs(value));
      is_rounded = is_rounded && value == std::round(value);
    }
    const double tolerance = is_exact ? 0 : 3e-5 * std::max(1.0, largest);
    size_t steps = 0;  // an FMA may give the next whole number, and a tone curve then a few more
    for (size_t k = 0; k < got[i].size(); ++k) {
      const bool is_step = is_rounded && !is_exact && got[i][k] != expected[i][k];
      ASSERT_NEAR(got[i][k], expected[i][k], is_step ? 0.02 * largest : tolerance)
          << "output " << i << ", element " << k;
      steps += is_step;
    }
    EXPECT_LE(steps, got[i].size() / 200) << "output " << i;
  }
}

class GpuAutoSchedule : public testing::TestWithParam<Case> {
 protected:
  void TearDown() override { set_order(retrograde_simt_forward); }
};

void check(const Case& c, bool with_estimates) {
  const auto expected = c.build().run(get_host_target());
  Program program = c.build();
  if (with_estimates) program.estimate();
  const Pipeline pipeline(program.outputs);
  const std::string source = pipeline.auto_schedule(with_gpu()).schedule_source;
  SCOPED_TRACE(source);
  const auto first = program.run(with_gpu());
  expect_close(first, expected, c.is_exact);
  // The bits are the same for every thread order, and each kernel is launched once: the host runs
  // no loop over launches.
  set_order(retrograde_simt_reverse);
  const int64_t before = retrograde_simt_call_count("cuLaunchKernel");
  EXPECT_EQ(program.run(with_gpu()), first);
  const int64_t launches = retrograde_simt_call_count("cuLaunchKernel") - before;
  set_order(retrograde_simt_forward);
  const size_t kernels = explain_kernels(pipeline, with_gpu()).kernels.size();
  EXPECT_GE(kernels, 1u);
  EXPECT_EQ(launches, static_cast<int64_t>(kernels));
}

TEST_P(GpuAutoSchedule, GivesWhatTheCpuGives) { check(GetParam(), true); }
TEST_P(GpuAutoSchedule, GivesItForSizesThatAreNotKnown) { check(GetParam(), false); }

// Names of partial sums contain new numbers.
std::string unnumbered(const std::string& text) {
  static const std::regex number("[$_][0-9]+");
  return std::regex_replace(text, number, "");
}

// Replaying the log reproduces the schedule.
TEST_P(GpuAutoSchedule, IsReplayedByItsLog) {
  Program program = GetParam().build();
  program.estimate();
  std::vector<graph::FuncPtr> outputs;
  for (const Func& f : program.outputs) outputs.push_back(f.function());
  const graph::Graph fresh = graph::parse_graph(graph::to_text(graph::graph_of(outputs)));
  const auto own = static_cast<std::ptrdiff_t>(graph::schedule_log(outputs).size());
  const std::string source = Pipeline(program.outputs).auto_schedule(with_gpu()).schedule_source;
  ScheduleLog log = graph::schedule_log(outputs);
  log.entries.erase(log.entries.begin(), log.entries.begin() + own);
  EXPECT_EQ(unnumbered(log.to_cpp()), unnumbered(source));
  graph::apply_log(ScheduleLog::parse(log.to_text()), fresh.outputs);
  EXPECT_EQ(unnumbered(graph::to_text(graph::graph_of(fresh.outputs))),
            unnumbered(graph::to_text(graph::graph_of(outputs))));
}

INSTANTIATE_TEST_SUITE_P(Programs, GpuAutoSchedule, testing::ValuesIn(cases()),
                         [](const auto& program) { return program.param.name; });

// ---- stages that stay on the host or keep their schedule ----

std::string kernels_of(const Pipeline& pipeline, const Target& target = with_gpu()) {
  std::string result;
  for (const KernelReport::Kernel& kernel : explain_kernels(pipeline, target).kernels) {
    for (const std::string& loops : kernel.loops) result += loops + "\n";
  }
  return result;
}

TEST(GpuAutoSchedules, OfATileAreItsThreads) {
  Func out("tiled");
  out(x, y) = x + y;
  out.set_estimates({{0, 640}, {0, 480}});
  Pipeline(out).auto_schedule(with_gpu());
  EXPECT_EQ(kernels_of(Pipeline(out)), out.name() + ": blocks y, x, threads y_1, x_1\n");
}

TEST(GpuAutoSchedules, LeaveToTheHostWhatOnlyItCanDo) {
  Func shown("shown"), doubled("doubled");
  shown(x) = print_when(x < 0, cast<float>(x), "below zero");
  doubled(x) = shown(x) * 2.0f;
  doubled(x) += 1.0f;
  shown.compute_root();
  Pipeline pipeline({doubled});
  const std::string source = pipeline.auto_schedule(with_gpu()).schedule_source;
  EXPECT_NE(kernels_of(pipeline).find("doubled"), std::string::npos) << source;
  EXPECT_EQ(kernels_of(pipeline).find("shown"), std::string::npos) << source;
  const Buffer<float> found = pipeline.realize({100}, with_gpu());
  for (int i = 0; i < 100; ++i) EXPECT_EQ(found(i), 2.0f * static_cast<float>(i) + 1.0f);
}

TEST(GpuAutoSchedules, LeaveInlinedCallsOfTheHostToIt) {
  Func shown("shown"), out("out");
  shown(x) = print_when(x < 0, cast<float>(x), "below zero");
  out(x) = shown(x) * 2.0f;
  out(x) += 1.0f;
  shown.compute_inline();
  Pipeline(out).auto_schedule(with_gpu());
  const std::string kernels = kernels_of(Pipeline(out));
  EXPECT_EQ(kernels.find(out.name() + ":"), std::string::npos) << kernels;
  EXPECT_NE(kernels.find(out.name() + ".update(0):"), std::string::npos) << kernels;
}

TEST(GpuAutoSchedules, KeepWhatAUserScheduled) {
  Func own("own"), out("out");
  Var xi("xi");
  own(x, y) = exp(cast<float>(x + y));
  out(x, y) = own(x, y) + own(x + 1, y);
  own.compute_root().parallel(y);
  const std::string source = Pipeline(out).auto_schedule(with_gpu()).schedule_source;
  EXPECT_EQ(source.find("own"), std::string::npos) << source;
  const std::string kernels = kernels_of(Pipeline(out));
  EXPECT_EQ(kernels.find(own.name()), std::string::npos) << kernels;
  EXPECT_NE(kernels.find(out.name()), std::string::npos) << kernels;
}

TEST(GpuAutoSchedules, AreForTheHostWhereItTellsOfEachStore) {
  for (const Target::Feature feature : {Target::TraceLoads, Target::TraceStores,
                                        Target::TraceRealizations, Target::CheckUnsafePromises}) {
    Func out("out");
    out(x) = x;
    const Target traced = with_gpu().with_feature(feature);
    Pipeline(out).auto_schedule(traced);
    EXPECT_EQ(kernels_of(Pipeline(out), traced), "") << traced.to_string();
  }
}

TEST(GpuAutoSchedules, AreNotSearched) {
  Func out("out");
  out(x) = x;
  AutoscheduleOptions options;
  options.search = true;
  const AutoSchedulerResults results = Pipeline(out).auto_schedule(with_gpu(), options);
  EXPECT_NE(results.search.note.find("the target has a GPU"), std::string::npos)
      << results.search.note;
  EXPECT_NE(results.schedule_source.find("gpu"), std::string::npos) << results.schedule_source;
}

// A grid has at most 65,535 blocks in all dimensions but one.
TEST(GpuAutoSchedules, HaveGridsForAnySize) {
  Func out("out");
  Var z("z");
  out(x, y, z) = x + 10 * y + z;
  Pipeline(out).auto_schedule(with_gpu());
  const Buffer<int> rows = out.realize({1, 280000, 1}, with_gpu());
  EXPECT_EQ(rows(0, 279999, 0), 2799990);
  const Buffer<int> planes = out.realize({1, 1, 70000}, with_gpu());
  EXPECT_EQ(planes(0, 0, 69999), 69999);
}

TEST(GpuAutoSchedules, HaveThreeDimensionsOfBlocks) {
  Func out("out");
  std::vector<Var> args;
  Expr sum = 0;
  for (const char* name : {"a", "b", "c", "d", "e"}) {
    args.emplace_back(name);
    sum = sum * 7 + args.back();
  }
  out(args) = sum;
  for (const Var& arg : args) out.set_estimate(arg, 0, 5);
  Pipeline(out).auto_schedule(with_gpu());
  const Buffer<int> found = out.realize({5, 4, 3, 2, 6}, with_gpu());
  EXPECT_EQ(found(4, 3, 2, 1, 5), (((4 * 7 + 3) * 7 + 2) * 7 + 1) * 7 + 5);
}

// Reduction loops with independent iterations become threads, too.
TEST(GpuAutoSchedules, RunIndependentReductionsInParallel) {
  Func out("out");
  RDom r(0, 1000, "r");
  out(x) = 0;
  out(2 * r) = r * r;
  Pipeline(out).auto_schedule(with_gpu());
  EXPECT_EQ(kernels_of(Pipeline(out)), out.name() + ": blocks x, threads x_1\n" + out.name() +
                                           ".update(0): blocks r.x, threads r.x_1\n");
  const Buffer<int> found = out.realize({2000}, with_gpu());
  EXPECT_EQ(found(1998), 999 * 999);
  EXPECT_EQ(found(1999), 0);
}

// Sums of floats at data-dependent indices are atomic updates only if bits may differ; sums of
// integers always are.
TEST(GpuAutoSchedules, UpdateAtomicallyWhatBitsAllow) {
  for (const bool deterministic : {true, false}) {
    Func counts("counts"), sums("sums");
    RDom r(0, 5000, "r");
    counts(x) = 0;
    counts((r * 7) % 11 * r % 3000) += 1;
    sums(x) = 0.0f;
    sums((r * 7) % 11 * r % 3000) += 1.0f;
    AutoscheduleOptions options;
    options.deterministic = deterministic;
    Pipeline pipeline({counts, sums});
    const std::string source = pipeline.auto_schedule(with_gpu(), options).schedule_source;
    const auto atomics = [&](const Func& f) { return f.function()->stage(1).schedule.atomic; };
    EXPECT_TRUE(atomics(counts)) << source;
    EXPECT_EQ(atomics(sums), !deterministic) << source;
    Realization found = pipeline.realize({3000}, with_gpu());
    const Buffer<int> of_counts = found[0];
    const Buffer<float> of_sums = found[1];
    EXPECT_EQ(std::accumulate(of_counts.data(), of_counts.data() + 3000, 0), 5000);
    for (int i = 0; i < 3000; ++i) EXPECT_EQ(of_sums(i), static_cast<float>(of_counts(i)));
  }
}

// A type without atomic additions gets partial sums, unless the options leave the strategy of scatters out.
TEST(GpuAutoSchedules, SplitScattersThatAreNotAtomic) {
  const auto scheduled = [&](const Type& type, const AutoscheduleOptions& options) {
    Func counts("counts");
    RDom r(0, 50000, "r");
    counts(x) = cast(type, 0);
    counts((r * 7) % 11) += cast(type, 1);
    counts.set_estimate(x, 0, 11);
    const Pipeline pipeline(counts);
    const std::string source = pipeline.auto_schedule(with_gpu(), options).schedule_source;
    const bool is_atomic = counts.function()->stage(1).schedule.atomic;
    return std::pair(is_atomic, source.find("rfactor") != std::string::npos);
  };
  AutoscheduleOptions without;
  without.without = {Decision::ScatterStrategy};
  using Found = std::pair<bool, bool>;  // atomic updates, partial sums
  EXPECT_EQ(scheduled(Int(32), {}), Found(true, false));
  EXPECT_EQ(scheduled(UInt(8), {}), Found(false, true));
  EXPECT_EQ(scheduled(Int(32), without), Found(false, false));
}

TEST(GpuAutoSchedules, CutSumsOverDomainsOfAnySize) {
  ImageParam in(Float(32), 2, "in");
  Func scaled("scaled"), total("total");
  RDom r(0, in.width(), 0, in.height(), "r");
  scaled(x, y) = exp(in(x, y));
  total() = 0.0f;
  total() += scaled(r.x, r.y) * scaled(r.x, in.height() - 1 - r.y);
  const std::string source = Pipeline(total).auto_schedule(with_gpu()).schedule_source;
  EXPECT_NE(source.find("rfactor"), std::string::npos) << source;
  for (const auto& [width, height] : {std::pair{50, 30}, std::pair{3, 7}, std::pair{1, 1}}) {
    const Buffer<float> image = picture(width, height);
    in.set(image);
    double expected = 0;
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i)
        expected += std::exp(double{image(i, j)}) * std::exp(double{image(i, height - 1 - j)});
    }
    const Buffer<float> found = total.realize({}, with_gpu());
    EXPECT_NEAR(found(), expected, 1e-4 * expected) << width << " x " << height;
  }
}

// The first of equal values wins, as on the CPU.
TEST(GpuAutoSchedules, FindTheFirstLeastOfMany) {
  Func least("least");
  RDom r(0, 90, 0, 100, "r");
  const Expr value = abs((r.x * 37 + r.y * 53) % 200 - 100);
  least() = Tuple(1000, -1, -1);
  const Expr is_less = value < least()[0];
  least() = Tuple(select(is_less, value, least()[0]), select(is_less, r.x, least()[1]),
                  select(is_less, r.y, least()[2]));
  const auto found = [&](const Target& target) {
    Realization values = least.realize({}, target);
    std::vector<int> result;
    for (int i = 0; i < 3; ++i) result.push_back(Buffer<int>(values[i])());
    return result;
  };
  const std::vector<int> expected = found(get_host_target());
  const std::string source = Pipeline(least).auto_schedule(with_gpu()).schedule_source;
  EXPECT_NE(source.find("rfactor"), std::string::npos) << source;
  EXPECT_EQ(found(with_gpu()), expected) << source;
}

class Sharpen : public Generator<Sharpen> {
 public:
  Input<Buffer<float, 2>> in{"in"};
  Output<Buffer<float, 2>> out{"out"};
  void generate() {
    const Func image = BoundaryConditions::repeat_edge(in);
    out(x, y) =
        5.0f * image(x, y) - image(x - 1, y) - image(x + 1, y) - image(x, y - 1) - image(x, y + 1);
  }
};

TEST(GpuAutoSchedules, OfGeneratorsAreCompiled) {
  const GeneratorContext context(with_gpu());
  auto sharpen = context.create<Sharpen>();
  sharpen->set_generator_param_values({{"auto_schedule", "true"}});
  const Module module = sharpen->build_module("sharpen");
  const ScheduleLog log = sharpen->get_pipeline().schedule_log();
  const bool has_kernel = std::ranges::any_of(log.entries, [](const ScheduleLog::Entry& entry) {
    const auto* run = std::get_if<graph::RunLoop>(&entry.directive);
    return run && run->kind == ForType::GpuBlock;
  });
  EXPECT_TRUE(has_kernel) << log.to_text();
}

}  // namespace
}  // namespace retrograde
