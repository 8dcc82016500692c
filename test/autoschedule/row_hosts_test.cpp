// Tests sums that the autoscheduler computes in the loop over rows of their consumer: which these are, and that the
// results are those of each on its own, with the same bits on any number of threads.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cmath>

#include "gradient/gradient_check.h"
#include "graph/graph.h"
#include "support/rules_schedule.h"
#include "support/variables.h"

namespace retrograde {
namespace {

const Var n("n"), g("g");

bool is_hosted_by(const Func& member, const Func& host) {
  const graph::LoopLevel& level = member.function()->schedule.compute_level;
  return level.kind == graph::LoopLevel::Kind::At && level.func == host.name();
}

void expect_near(const Buffer<float>& found, const Buffer<float>& expected) {
  ASSERT_EQ(found.size_in_bytes(), expected.size_in_bytes());
  for (size_t i = 0; i < found.size_in_bytes() / sizeof(float); ++i) {
    const float want = expected.data()[i];
    ASSERT_NEAR(found.data()[i], want, 1e-4f * (1 + std::abs(want))) << i;
  }
}

void run(Pipeline& pipeline, const std::vector<Buffer<>>& results) {
  pipeline.realize(Realization(results));
}

// The mean and the variance of each row.
struct Normalisation {
  int width = 1000, height = 601;
  Func in{"in"}, mean{"mean"}, variance{"variance"}, out{"out"};
  Buffer<float> image = gradient::random_image({width, height}, -1, 2, 5);

  Normalisation() { define(); }
  void define() {
    RDom r(0, width, "r");
    in(x, y) = image(x, y);
    mean(y) = 0.0f;
    mean(y) += in(r, y) / static_cast<float>(width);
    variance(y) = 0.0f;
    variance(y) += (in(r, y) - mean(y)) * (in(r, y) - mean(y)) / static_cast<float>(width);
    out(x, y) = (in(x, y) - mean(y)) / sqrt(variance(y) + 1e-5f);
    out.bound(x, 0, width).bound(y, 0, height);
  }
};

TEST(RowHosts, HaveMeanAndVarianceOfTheirRows) {
  Normalisation scheduled, declared;
  Pipeline pipeline(scheduled.out);
  schedule_by_rules(pipeline);
  EXPECT_TRUE(is_hosted_by(scheduled.mean, scheduled.out));
  EXPECT_TRUE(is_hosted_by(scheduled.variance, scheduled.out));
  declared.mean.compute_root();
  declared.variance.compute_root();
  const Buffer<float> found = pipeline.realize({1000, 601});
  expect_near(found, declared.out.realize({1000, 601}));
  for (const int threads : {1, 3}) {
    pipeline.jit_handlers().thread_limit = threads;
    const Buffer<float> other = pipeline.realize({1000, 601});
    EXPECT_TRUE(gradient::same_bits(found, other)) << threads;
  }
}

TEST(RowHosts, ShareTheirLoopWithCopiesThatLeaveThePipeline) {
  Normalisation scheduled, declared;
  Func kept("kept"), also("also");
  kept(n) = scheduled.mean(n);
  also(y) = scheduled.variance(y);
  kept.bound(n, 0, 601);
  also.bound(y, 0, 601);
  Pipeline pipeline({scheduled.out, kept, also});
  schedule_by_rules(pipeline);
  EXPECT_TRUE(is_hosted_by(scheduled.mean, scheduled.out));
  EXPECT_TRUE(is_hosted_by(scheduled.variance, scheduled.out));
  Buffer<float> out(1000, 601), mean(601), variance(601);
  run(pipeline, {out, mean, variance});
  declared.mean.compute_root();
  declared.variance.compute_root();
  expect_near(out, declared.out.realize({1000, 601}));
  expect_near(mean, declared.mean.realize({601}));
  expect_near(variance, declared.variance.realize({601}));
}

TEST(RowHosts, LeaveSumsAloneThatOthersRead) {
  Normalisation scheduled;
  Func other("other");
  other(y) = scheduled.mean(y) * scheduled.mean(600 - y);
  other.bound(y, 0, 601);
  schedule_by_rules(Pipeline({scheduled.out, other}));
  EXPECT_FALSE(is_hosted_by(scheduled.mean, scheduled.out));
  EXPECT_TRUE(is_hosted_by(scheduled.variance, scheduled.out));
}

TEST(RowHosts, NeedLargeFuncs) {
  Normalisation scheduled;
  scheduled.out.bound(y, 0, 100);
  schedule_by_rules(Pipeline(scheduled.out));
  EXPECT_FALSE(is_hosted_by(scheduled.mean, scheduled.out));
}

// Groups of four channels: a row is a quotient of a coordinate.
struct Groups {
  Func mean{"mean"}, square{"square"}, out{"out"};
  Buffer<float> image = gradient::random_image({70, 50, 24, 9}, -1, 2, 5);

  Groups() {
    RDom r(0, 70, 0, 50, 0, 4, "r");
    const Expr pixel = image(r.x, r.y, 4 * g + r.z, n);
    mean(g, n) = 0.0f;
    mean(g, n) += pixel / 14000.0f;
    square(g, n) = 0.0f;
    square(g, n) += pixel * pixel / 14000.0f;
    out(x, y, c, n) = (image(x, y, c, n) - mean(c / 4, n)) / sqrt(square(c / 4, n) + 1.0f);
    out.bound(x, 0, 70).bound(y, 0, 50).bound(c, 0, 24).bound(n, 0, 9);
  }
};

TEST(RowHosts, MayNameRowsByQuotients) {
  Groups scheduled, declared;
  Func kept("kept");
  kept(g, n) = scheduled.mean(g, n);
  kept.bound(g, 0, 6).bound(n, 0, 9);
  Pipeline pipeline({scheduled.out, kept});
  schedule_by_rules(pipeline);
  EXPECT_TRUE(is_hosted_by(scheduled.mean, scheduled.out));
  EXPECT_TRUE(is_hosted_by(scheduled.square, scheduled.out));
  Buffer<float> out(70, 50, 24, 9), mean(6, 9);
  run(pipeline, {out, mean});
  declared.mean.compute_root();
  declared.square.compute_root();
  expect_near(out, declared.out.realize({70, 50, 24, 9}));
  expect_near(mean, declared.mean.realize({6, 9}));
}

// The normalised values, which the host alone reads, take no memory: their sums are those of the host's rows.
TEST(RowHosts, HaveSumsThatAreReadThroughWhatIsInlined) {
  Groups scheduled, declared;
  const auto activated = [](const Func& normalised) {
    Func active("active");
    const auto value = [&] { return normalised(x, y, c, n); };
    active(x, y, c, n) = value() / (1.0f + exp(-value())) + 0.1f * value() * sin(value());
    active.bound(x, 0, 70).bound(y, 0, 50).bound(c, 0, 24).bound(n, 0, 9);
    return active;
  };
  const Func active = activated(scheduled.out);
  Pipeline pipeline(active);
  schedule_by_rules(pipeline);
  EXPECT_EQ(scheduled.out.function()->schedule.compute_level.kind, graph::LoopLevel::Kind::Inlined);
  EXPECT_TRUE(is_hosted_by(scheduled.mean, active));
  EXPECT_TRUE(is_hosted_by(scheduled.square, active));
  declared.mean.compute_root();
  declared.square.compute_root();
  const Buffer<float> found = pipeline.realize({70, 50, 24, 9});
  expect_near(found, activated(declared.out).realize({70, 50, 24, 9}));
  pipeline.jit_handlers().thread_limit = 1;
  const Buffer<float> other = pipeline.realize({70, 50, 24, 9});
  EXPECT_TRUE(gradient::same_bits(found, other));
}

// The adjoint of the image needs two sums of each row; those by the scale go across all rows.
TEST(RowHosts, HaveTheAdjointSumsOfTheirRows) {
  constexpr int width = 1000, height = 601;
  const Buffer<float> image = gradient::random_image({width, height}, -1, 2, 5);
  const Buffer<float> scale = gradient::random_image({width}, 0, 1, 7);
  const auto gradients = [&] {
    Func mean("mean"), variance("variance"), out("out"), seed("seed");
    RDom r(0, width, "r");
    mean(y) = 0.0f;
    mean(y) += image(r, y) / static_cast<float>(width);
    variance(y) = 0.0f;
    variance(y) += (image(r, y) - mean(y)) * (image(r, y) - mean(y)) / static_cast<float>(width);
    out(x, y) = scale(x) * (image(x, y) - mean(y)) / sqrt(variance(y) + 1e-5f);
    seed(x, y) = cast<float>((x + 3 * y) % 11) - 5.0f;
    const Derivative d = propagate_adjoints(out, seed, {{0, width}, {0, height}});
    Func by_image("by_image"), by_scale("by_scale");
    by_image(x, y) = d(image)(x, y);
    by_scale(x) = d(scale)(x);
    by_image.bound(x, 0, width).bound(y, 0, height);
    by_scale.bound(x, 0, width);
    return std::vector<Func>{by_image, by_scale};
  };
  Pipeline scheduled(gradients()), plain(gradients());
  scheduled.auto_schedule(get_host_target());
  plain.set_autoschedule({.without = {Decision::Slices}});
  Buffer<float> a(width, height), b(width), also_a(width, height), also_b(width);
  run(scheduled, {a, b});
  run(plain, {also_a, also_b});
  expect_near(a, also_a);
  expect_near(b, also_b);
}

}  // namespace
}  // namespace retrograde
