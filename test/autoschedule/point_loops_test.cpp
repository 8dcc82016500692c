// Funcs that have a few numbers for each of many points, as the autoscheduler runs them: values and gradients are those of
// the interpreter on any number of threads.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "gradient/gradient_check.h"
#include "graph/graph.h"
#include "ir/build.h"
#include "support/schedule_log.h"

namespace retrograde {
namespace {

const Var j("j"), k("k"), i("i"), x("x"), y("y");

// Neither a multiple of a vector nor of a tile.
constexpr int many = 150, bones = 7;

Func scheduled(Func f) {
  Pipeline(f).auto_schedule(get_host_target());
  return f;
}

// Points blended from the transformations of bones.
struct Skinning {
  explicit Skinning(int count = many) {
    points = gradient::random_image({3, count}, -1, 1, 3);
    weights = gradient::random_image({bones, count}, 0.1, 1, 4);
    matrices = gradient::random_image({4, 3, bones}, -1, 1, 5);
    const RDom r(0, bones, "r");
    blended(j, k, i) = 0.0f;
    blended(j, k, i) += weights(r, i) * matrices(j, k, r);
    moved(k, i) = blended(0, k, i) * points(0, i) + blended(1, k, i) * points(1, i) +
                  blended(2, k, i) * points(2, i) + blended(3, k, i);
    moved.bound(k, 0, 3).bound(i, 0, count);
  }
  Buffer<float> points, weights, matrices;
  Func blended{"blended"}, moved{"moved"};
};

TEST(PointLoops, HaveTheValuesOfTheInterpreter) {
  Skinning s;
  gradient::expect_machine_code_agrees(scheduled(s.moved), {{0, 0}, {3, many}});
}

// Sums at constant numbers, sums of a few numbers for each point, sums over all points.
TEST(PointLoops, OfGradientsAgreeWithTheInterpreter) {
  Skinning s;
  const Derivative d = propagate_adjoints(s.moved, gradient::random_image({3, many}, -1, 1, 6));
  gradient::expect_machine_code_agrees(d(s.points), {{0, 0}, {3, many}});
  gradient::expect_machine_code_agrees(d(s.weights), {{0, 0}, {bones, many}});
  gradient::expect_machine_code_agrees(d(s.matrices), {{0, 0, 0}, {4, 3, bones}});
}

TEST(PointLoops, OfGradientsAreCentralDifferences) {
  Skinning s;
  gradient::expect_gradient(gradient::weighted_sum(s.moved, {3, many}), s.matrices, {});
}

// Colours innermost: rows of an image are points, its columns are tasks.
struct ColourMatrix {
  explicit ColourMatrix(int channels = 3, int width = many) {
    image = gradient::random_image({channels, width, 11}, 0.1, 1, 3);
    matrix = gradient::random_image({channels, channels}, 0.1, 1, 4);
    const RDom r(0, channels, "r");
    mixed(k, x, y) = 0.0f;
    mixed(k, x, y) += matrix(r, k) * image(r, x, y);
    result(k, x, y) = sqrt(mixed(k, x, y)) + mixed(k, x, y) * mixed(k, x, y);
    result.bound(k, 0, channels).bound(x, 0, width).bound(y, 0, 11);
  }
  Buffer<float> image, matrix;
  Func mixed{"mixed"}, result{"result"};
};

TEST(PointLoops, TakeRowsOfImagesWithColoursInnermost) {
  ColourMatrix c;
  scheduled(c.result);
  ColourMatrix again;
  gradient::expect_machine_code_agrees(scheduled(again.result), {{0, 0, 0}, {3, many, 11}});
  const Derivative d =
      propagate_adjoints(again.mixed, gradient::random_image({3, many, 11}, -1, 1, 6));
  gradient::expect_machine_code_agrees(d(again.image), {{0, 0, 0}, {3, many, 11}});
  gradient::expect_machine_code_agrees(d(again.matrix), {{0, 0}, {3, 3}});
}

// If a consumer gathers points by data-dependent indices, the numbers of a point stay together.
TEST(PointLoops, KeepNumbersTogetherThatAreGathered) {
  const auto at = gradient::random_image({many}, 0, 1, 3);
  const Buffer<float> points = gradient::random_image({3, many}, -1, 1, 4);
  const Buffer<float> matrix = gradient::random_image({3, 3}, -1, 1, 5);
  const auto program = [&](Func moved) {
    Func found("found");
    const RDom r(0, 3, "r");
    moved(k, i) = 0.0f;
    moved(k, i) += matrix(r, k) * points(r, i);
    found(k, i) = moved(k, clamp(cast<int>(at(i) * many), 0, many - 1)) * 2.0f;
    found.bound(k, 0, 3).bound(i, 0, many);
    return scheduled(found);
  };
  Func moved("moved");
  const Func found = program(moved);
  gradient::expect_machine_code_agrees(found, {{0, 0}, {3, many}});
}

// Each stage of the sum covers other numbers; all of them share the loop over points.
TEST(PointLoops, MayUpdateSingleNumbers) {
  const auto program = [](Func f, const Buffer<float>& in) {
    Func out("out");
    const RDom r(0, 5, "r");
    f(k, i) = in(k, i);
    f(0, i) += in(1, i) * in(r, i);
    f(2, i) = f(0, i) * f(1, i);
    f(k, i) += in(r, i) * f(k, i);
    out(k, i) = f(k, i) - 1.0f;
    out.bound(k, 0, 3).bound(i, 0, many);
    return out;
  };
  const Buffer<float> in = gradient::random_image({5, many}, -1, 1, 4);
  const Func f("f");
  gradient::expect_machine_code_agrees(scheduled(program(f, in)), {{0, 0}, {3, many}});
}

// A 3x3 matrix of sums over all points: each point is read once.
TEST(PointLoops, OfLongSumsAddAllElementsTogether) {
  constexpr int terms = 5003;
  const auto program = [&] {
    const Buffer<float> p = gradient::random_image({3, terms}, -1, 1, 3);
    const Buffer<float> q = gradient::random_image({3, terms}, -1, 1, 4);
    Func covariance("covariance");
    const RDom r(0, terms, "r");
    covariance(j, k) = 0.0f;
    covariance(j, k) += p(k, r) * q(j, r);
    covariance.bound(j, 0, 3).bound(k, 0, 3);
    return covariance;
  };
  Pipeline pipeline(program());
  pipeline.auto_schedule(get_host_target());
  pipeline.jit_handlers().thread_limit = 1;
  const Buffer<float> found = pipeline.realize({3, 3}), expected = program().realize({3, 3});
  expected.for_each_element([&](const int* at) { EXPECT_NEAR(found(at), expected(at), 0.01); });
  for (const int threads : {2, 5}) {
    pipeline.jit_handlers().thread_limit = threads;
    EXPECT_TRUE(gradient::same_bits(pipeline.realize({3, 3}), found)) << threads;
  }
}

// Terms of a sum over points are gathered from the weights: the tile has all numbers, so that each is gathered once.
TEST(PointLoops, OfSumsOverPointsGatherEachTermOnce) {
  if (!get_host_target().has_feature(Target::AVX512)) GTEST_SKIP() << "too few registers";
  Skinning s(3000);
  Pipeline pipeline(
      propagate_adjoints(s.moved, gradient::random_image({3, 3000}, -1, 1, 6))(s.matrices));
  pipeline.auto_schedule(get_host_target());
  const ScheduleLog log = pipeline.schedule_log();
  const auto has_side = [&](const std::string& loop, int size) {
    return any_directive<graph::SplitLoop>(log, [&](const auto& entry, const auto& split) {
      return entry.func.find("_adj") != std::string::npos && entry.stage == 1 &&
             split.old == loop && ir::as_const_int(split.factor) == size;
    });
  };
  EXPECT_TRUE(has_side("_0", 4) && has_side("_1", 3)) << log.to_text();
}

}  // namespace
}  // namespace retrograde
