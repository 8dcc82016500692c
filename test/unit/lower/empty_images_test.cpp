// Images without elements, as inputs and as outputs.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <vector>

#include "support/variables.h"

namespace retrograde {
namespace {

// f(x, y) = 2 im(x, y) through a stage at root.
struct Doubled {
  ImageParam im{Float(32), 2, "im"};
  Func stage{"stage"}, f{"f"};
  Doubled() {
    stage(x, y) = im(x, y);
    f(x, y) = 2.0f * stage(x, y);
    stage.compute_root();
  }
  std::vector<int> extents_over(const std::vector<int>& sizes) {
    im.set(Buffer<float>(sizes));
    const Buffer<float> result = f.realize(sizes);
    return {result.width(), result.height()};
  }
};

TEST(EmptyImages, AreResults) {
  for (const std::vector<int>& sizes : std::vector<std::vector<int>>{{0, 0}, {5, 0}, {0, 5}}) {
    Doubled plain, wide, cut;
    EXPECT_EQ(plain.extents_over(sizes), sizes);
    wide.f.vectorize(x, 8, TailStrategy::GuardWithIf).parallel(y);
    wide.stage.vectorize(x, 8, TailStrategy::GuardWithIf);
    EXPECT_EQ(wide.extents_over(sizes), sizes);
    cut.f.vectorize(x, 8, TailStrategy::Predicate).unroll(y, 2, TailStrategy::GuardWithIf);
    EXPECT_EQ(cut.extents_over(sizes), sizes);
  }
}

TEST(EmptyImages, AddUpToNothing) {
  for (bool is_wide : {false, true}) {
    ImageParam im(Float(32), 2, "im");
    RDom r(0, im.height());
    Func f("f");
    f(x) = 1.0f;
    f(x) += im(x, r);
    if (is_wide) f.update().vectorize(x, 4);
    im.set(Buffer<float>(4, 0));
    const Buffer<float> result = f.realize({4});
    for (int i = 0; i < 4; i++) EXPECT_EQ(result(i), 1.0f);
  }
}

TEST(EmptyImages, AskForNothing) {
  for (const TailStrategy tail : {TailStrategy::ShiftInwards, TailStrategy::RoundUp}) {
    Doubled program;
    program.f.vectorize(x, 8, tail);
    EXPECT_EQ(program.extents_over({0, 5}), (std::vector<int>{0, 5}));
  }
}

// The terms of a loss over all elements, with reads at and beyond the borders.
using Term = Expr (*)(const ImageParam& im, const RDom& r);
const std::vector<Term> terms = {
    [](const ImageParam& im, const RDom& r) { return im(r.x, r.y) * im(r.x, r.y); },
    [](const ImageParam& im, const RDom& r) {
      const Func f = BoundaryConditions::repeat_edge(im);
      return f(r.x, r.y) * f(r.x + 1, r.y);
    },
    [](const ImageParam& im, const RDom& r) {
      const Func f = BoundaryConditions::mirror_image(im);
      return f(r.x, r.y) * f(r.x, r.y - 1);
    },
    [](const ImageParam& im, const RDom& r) {
      const Func f = BoundaryConditions::constant_exterior(im, 1.0f);
      return f(r.x, r.y) * f(r.x - 1, r.y);
    },
    [](const ImageParam& im, const RDom& r) { return im(clamp(r.x + 1, 0, im.width() - 1), r.y); },
    [](const ImageParam& im, const RDom& r) {
      Func stage("stage");
      stage(x, y) = 2.0f * im(x, y);
      return stage(r.x, r.y) * stage(r.x, r.y);
    },
    [](const ImageParam& im, const RDom& r) {
      Func scan("scan");
      const RDom along(1, im.width() - 1);
      scan(x, y) = im(x, y);
      scan(along, y) += 0.5f * scan(along - 1, y);
      return scan(r.x, r.y) * scan(r.x, r.y);
    }};

TEST(EmptyImages, HaveEmptyGradients) {
  for (const Term& term : terms) {
    ImageParam im(Float(32), 2, "im");
    const RDom r(0, im.width(), 0, im.height());
    Func loss("loss");
    loss() = 0.0f;
    loss() += term(im, r);
    Func gradient = propagate_adjoints(loss)(im);
    for (const std::vector<int>& sizes : std::vector<std::vector<int>>{{0, 3}, {3, 0}, {0, 0}}) {
      im.set(Buffer<float>(sizes));
      EXPECT_NO_THROW(gradient.realize(sizes)) << &term - terms.data();
    }
  }
}

TEST(EmptyImages, PlacesOfDataInAnEmptyOne) {
  using Schedule = void (*)(Func&, const RDom&);
  const Schedule schedules[] = {
      [](Func&, const RDom&) {},
      [](Func& f, const RDom& r) {
        f.update().atomic().vectorize(r, 8, TailStrategy::GuardWithIf);
      },
      [](Func& f, const RDom& r) { f.update().atomic().vectorize(r, 8, TailStrategy::Predicate); }};
  for (const Schedule schedule : schedules) {
    ImageParam at(Int(32), 1, "at");
    RDom r(0, at.width());
    Func f("f");
    f(x) = 0;
    f(clamp(at(r), 0, 3)) += r + 1;
    schedule(f, r);
    at.set(Buffer<int>(0));
    EXPECT_EQ(Buffer<int>(f.realize({4}))(0), 0);
  }
}

}  // namespace
}  // namespace retrograde
