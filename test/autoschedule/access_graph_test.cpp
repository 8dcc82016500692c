// The access graphs of small programs, as text: golden/access/<name>.txt. RETROGRADE_UPDATE_GOLDEN=1 writes the files;
// read the difference before you commit it.
#include "autoschedule/access/access_graph.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "autodiff/derivative.h"
#include "frontend/language/boundary_conditions.h"
#include "support/same_numbers.h"
#include "support/variables.h"

namespace retrograde {
namespace {

using Program = std::vector<Func>;  // outputs

std::vector<graph::FuncPtr> functions(const Program& program) {
  std::vector<graph::FuncPtr> result;
  for (const Func& f : program) result.push_back(f.function());
  return result;
}

Program stencil_with_borders() {
  ImageParam image(Float(32), 2, "image");
  Func edge = BoundaryConditions::repeat_edge(image),
       zero = BoundaryConditions::constant_exterior(image, 0.0f),
       mirrored = BoundaryConditions::mirror_image(image), out("out");
  out(x, y) = edge(x - 1, y) + 2.0f * edge(x, y) + edge(x + 1, y) + zero(x, y - 1) + mirrored(x, y);
  return {out};
}

Program convolution() {
  ImageParam image(Float(32), 3, "image"), filter(Float(32), 4, "filter"),
      seed(Float(32), 3, "seed");
  Func layer("layer");
  RDom r(0, 3, 0, 3, 0, 16);
  layer(x, y, c) += filter(r.x, r.y, r.z, c) * image(x + r.x, y + r.y, r.z);
  const Derivative d = propagate_adjoints(layer, seed, {{0, 64}, {0, 48}, {0, 16}});
  return {layer, d(image), d(filter)};
}

Program strided_read() {
  ImageParam image(Float(32), 1, "image"), seed(Float(32), 1, "seed");
  Func half("half"), twice("twice");
  RDom r(0, 3);
  half(x) += image(2 * x + r) * (r + 1);
  twice(x) = half(x / 2) + half((x + 1) / 2) + half(x % 8);
  const Derivative d = propagate_adjoints(twice, seed, {{0, 64}});
  return {twice, d(image)};
}

Program warp() {
  ImageParam image(Float(32), 2, "image"), flow(Float(32), 3, "flow"), seed(Float(32), 2, "seed");
  Func warped("warped"), i("i");
  i(x, y) = clamp(cast<int>(floor(x + flow(x, y, 0))), 0, 62);
  const Expr j = clamp(cast<int>(floor(y + flow(x, y, 1))), 0, 47);
  warped(x, y) = image(i(x, y), j) + image(i(x, y) + 1, j) * 0.5f +
                 image(x + clamp(cast<int>(flow(x, y, 0)), -3, 3), y);
  const Derivative d = propagate_adjoints(warped, seed, {{0, 64}, {0, 48}});
  return {warped, d(image)};
}

Program sum_over_rows() {
  ImageParam image(Float(32), 2, "image");
  Param<int> first("first");
  Func rows("rows"), total("total");
  RDom r(0, 64), s(0, 64, 0, 48);
  s.where(s.x + s.y < 80);
  rows(y) += exp(image(r, y + first)) * sqrt(image(r, 0));
  total() += rows(s.y) * image(s.x, s.y);
  return {total};
}

Program time_loop() {
  ImageParam start(Float(32), 1, "start");
  Func u("u"), last("last");
  RDom r(1, 62, 1, 20);
  u(x, t) = select(t == 0, start(x), 0.0f);
  u(r.x, r.y) = 0.25f * u(r.x - 1, r.y - 1) + 0.5f * u(r.x, r.y - 1) + 0.25f * u(r.x + 1, r.y - 1);
  last(x) = u(x, 20);
  return {last};
}

Program index_arrays() {
  ImageParam values(Float(32), 1, "values"), from(Int(32), 1, "from"), to(UInt(8), 1, "to");
  Func gathered("gathered"), bins("bins");
  RDom r(0, 100);
  gathered(x) = values(clamp(from(x), 0, 99)) - values(clamp(from(x + 1), 0, 99));
  bins(x) = 0.0f;
  bins(cast<int>(to(r))) += gathered(r);
  return {bins};
}

Program tuple() {
  ImageParam image(Float(32), 1, "image");
  Func best("best"), out("out");
  RDom r(0, 64);
  best() = Tuple(0.0f, 0);
  best() = Tuple(max(best()[0], image(r)), select(image(r) > best()[0], r, best()[1]));
  out(x) = select(x >= best()[1], image(x), select(x % 2 == 1, image(x - 1), best()[0]));
  return {out};
}

struct Case {
  const char* name;
  Program (*build)();
};

class AccessGraphText : public ::testing::TestWithParam<Case> {};

TEST_P(AccessGraphText, IsWhatItsFileSays) {
  const Program program = GetParam().build();
  const std::string text = same_numbers(print(planning::AccessGraph(functions(program))));
  const std::string file =
      std::string(RETROGRADE_TEST_DIR) + "/golden/access/" + GetParam().name + ".txt";
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(file) << text;
  std::ifstream in(file);
  EXPECT_EQ(text, std::string(std::istreambuf_iterator<char>(in), {}));
}

INSTANTIATE_TEST_SUITE_P(Programs, AccessGraphText,
                         ::testing::Values(Case{"stencil_with_borders", stencil_with_borders},
                                           Case{"convolution", convolution},
                                           Case{"strided_read", strided_read}, Case{"warp", warp},
                                           Case{"sum_over_rows", sum_over_rows},
                                           Case{"time_loop", time_loop},
                                           Case{"index_arrays", index_arrays},
                                           Case{"tuple", tuple}),
                         [](const auto& info) { return std::string(info.param.name); });

size_t nodes_of_chain(int steps) {
  Func last("step");
  ImageParam image(Float(32), 1, "image");
  last(x) = image(x);
  for (int i = 1; i < steps; ++i) {
    Func next("step");
    next(x) = 0.5f * last(clamp(x - 1, 0, 99)) + 0.5f * last(clamp(x + 1, 0, 99));
    last = next;
  }
  Func loss("loss");
  RDom r(0, 100);
  loss() += last(r) * last(r);
  const Derivative d = propagate_adjoints(loss, {.wrt = {image}});
  return planning::AccessGraph(functions({loss, d(image)})).nodes_visited();
}

// One expression of unrolled steps, each of which reads at a place that the last one computed.
size_t nodes_of_march(int steps) {
  ImageParam field(Float(32), 1, "field");
  Func out("out");
  Expr place = x;
  for (int i = 0; i < steps; ++i) place = clamp(place + cast<int>(field(place) * 2.0f), 0, 99);
  out(x) = cast<float>(place);
  return planning::AccessGraph(functions({out})).nodes_visited();
}

TEST(AccessGraphOfUnrolledSteps, VisitsEachNodeAFixedNumberOfTimes) {
  const size_t chain = nodes_of_chain(50), march = nodes_of_march(50);
  EXPECT_LT(nodes_of_chain(500), 11 * chain);
  EXPECT_LT(nodes_of_march(500), 11 * march);
  EXPECT_LT(chain / 50, 400u);
}

TEST(AccessGraphLikeAnEarlierOne, IsTheSameWithFewerVisits) {
  ImageParam image(Float(32), 1, "image");
  Func first("first"), second("second"), out("out");
  first(x) = image(clamp(x, 0, 99)) * 2.0f;
  second(x) = first(cast<int>(first(x))) + first(x + 1);
  out(x) = second(x) + second(x + 2);
  planning::AccessGraph before(functions({out}));
  first.in(second)
      .compute_root();  // second reads it instead, and all numbers of later Funcs are others
  const planning::AccessGraph fresh(functions({out}));
  const planning::AccessGraph after(functions({out}), std::move(before));
  EXPECT_EQ(print(after), print(fresh));
  EXPECT_GT(after.nodes_visited(), 0u);
  EXPECT_LT(after.nodes_visited(), fresh.nodes_visited());
}

}  // namespace
}  // namespace retrograde
