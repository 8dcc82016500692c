// Tests sums that share the loop over rows of another Func, and what all of these read, which is computed in it: which
// these are, and that the results are those of each on its own, with the same bits on any number of threads.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cmath>
#include <functional>

#include "gradient/gradient_check.h"
#include "graph/graph.h"

namespace retrograde {
namespace {

const Var x("x"), y("y"), c("c"), n("n"), g("g");

bool is_hosted_by(const Func& member, const Func& host) {
  const graph::LoopLevel& level = member.function()->schedule.compute_level;
  return level.kind == graph::LoopLevel::Kind::At && level.func == host.name();
}

// The number of stages that share loops with the host.
int guests_of(const std::vector<Func>& outputs, const Func& host) {
  std::vector<graph::FuncPtr> funcs;
  for (const Func& f : outputs) funcs.push_back(f.function());
  int guests = 0;
  for (const graph::FuncPtr& f : graph::topological_order(funcs)) {
    for (int s = 0; s < f->stage_count(); ++s)
      guests += f->stage(s).schedule.fuse_level.func == host.name();
  }
  return guests;
}

void expect_near(const Buffer<float>& found, const Buffer<float>& expected) {
  ASSERT_EQ(found.size_in_bytes(), expected.size_in_bytes());
  for (size_t i = 0; i < found.size_in_bytes() / sizeof(float); ++i) {
    const float want = expected.data()[i];
    ASSERT_NEAR(found.data()[i], want, 2e-4f * (1 + std::abs(want))) << i;
  }
}

// The gradients of an activation of normalised maps, by the maps and by a scale and a shift for each channel. Statistics
// are those of groups of channels of an image, or, with group 0, of a channel of all images.
struct Normalisation {
  int width = 40, height = 30, channels = 24, images = 12, group = 4;
  Buffer<float> image, scale, shift, mean, variance;
  Func normalised{"normalised"}, by_image{"by_image"}, by_scale{"by_scale"}, by_shift{"by_shift"};
  Func adjoint{"adjoint"};  // of what is normalised

  explicit Normalisation(int group_size = 4) : group(group_size) {
    image = gradient::random_image({width, height, channels, images}, -1, 2, 5);
    scale = gradient::random_image({channels}, 0.5f, 2, 7);
    shift = gradient::random_image({channels}, -1, 1, 9);
    const int terms = width * height * (group ? group : images);
    RDom r(0, width, 0, height, 0, group ? group : images, "r");
    Func mu("mu"), square("square"), active("active"), seed("seed");
    const Expr pixel = group ? image(r.x, r.y, group * g + r.z, n) : image(r.x, r.y, g, r.z);
    const std::vector<Var> set = group ? std::vector<Var>{g, n} : std::vector<Var>{g};
    mu(set) = 0.0f;
    mu(set) += pixel / static_cast<float>(terms);
    square(set) = 0.0f;
    square(set) += pixel * pixel / static_cast<float>(terms);
    const std::vector<Expr> at = group ? std::vector<Expr>{c / group, n} : std::vector<Expr>{c};
    const Expr spread = sqrt(square(at) - mu(at) * mu(at) + 1e-3f);
    normalised(x, y, c, n) = scale(c) * (image(x, y, c, n) - mu(at)) / spread + shift(c);
    active(x, y, c, n) = normalised(x, y, c, n) / (1.0f + exp(-normalised(x, y, c, n)));
    seed(x, y, c, n) = cast<float>((x + 3 * y + 5 * c + n) % 11) - 5.0f;
    const Derivative d =
        propagate_adjoints(active, seed, {{0, width}, {0, height}, {0, channels}, {0, images}});
    adjoint = d.adjoint(normalised);
    by_image(x, y, c, n) = d(image)(x, y, c, n);
    by_scale(c) = d(scale)(c);
    by_shift(c) = d(shift)(c);
    by_image.bound(x, 0, width).bound(y, 0, height).bound(c, 0, channels).bound(n, 0, images);
    by_scale.bound(c, 0, channels);
    by_shift.bound(c, 0, channels);
  }

  std::vector<Func> outputs() const { return {by_image, by_scale, by_shift}; }
  std::vector<Buffer<float>> results() const {
    return {Buffer<float>(width, height, channels, images), Buffer<float>(channels),
            Buffer<float>(channels)};
  }
};

// The gradients of an activation of normalised rows, by the rows and by a scale and a shift for each column: sums over
// rows, with 4096 terms or more.
struct LayerNormalisation {
  int width = 48, rows = 0;
  Buffer<float> image, scale, shift;
  Func normalised{"normalised"}, by_image{"by_image"}, by_scale{"by_scale"}, by_shift{"by_shift"};
  Func adjoint{"adjoint"};  // of what is normalised

  explicit LayerNormalisation(int number_of_rows, int sets = 0) : rows(number_of_rows) {
    // With `sets`, rows have two coordinates.
    std::vector<int> sizes{width, rows};
    std::vector<Var> row{y};
    if (sets > 0) {
      sizes.push_back(sets);
      row.push_back(n);
    }
    const auto at = [&](const Expr& column) {
      std::vector<Expr> place{column};
      place.insert(place.end(), row.begin(), row.end());
      return place;
    };
    const std::vector<Expr> this_row(row.begin(), row.end());
    image = gradient::random_image(sizes, -1, 2, 5);
    scale = gradient::random_image({width}, 0.5f, 2, 7);
    shift = gradient::random_image({width}, -1, 1, 9);
    RDom r(0, width);
    Func mu("mu"), square("square"), active("active"), seed("seed");
    mu(row) = 0.0f;
    mu(row) += image(at(r)) / static_cast<float>(width);
    square(row) = 0.0f;
    square(row) += image(at(r)) * image(at(r)) / static_cast<float>(width);
    std::vector<Var> all{x};
    all.insert(all.end(), row.begin(), row.end());
    const Expr spread = sqrt(square(this_row) - mu(this_row) * mu(this_row) + 1e-3f);
    normalised(all) = scale(x) * (image(at(x)) - mu(this_row)) / spread + shift(x);
    active(all) = normalised(all) / (1.0f + exp(-normalised(all)));
    Expr sum = x;
    for (const Var& v : row) sum = sum + 3 * v;
    seed(all) = cast<float>(sum % 11) - 5.0f;
    Region region;
    for (const int size : sizes) region.push_back({0, size});
    const Derivative d = propagate_adjoints(active, seed, region);
    adjoint = d.adjoint(normalised);
    by_image(all) = Func(d(image))(std::vector<Expr>(all.begin(), all.end()));
    by_scale(x) = d(scale)(x);
    by_shift(x) = d(shift)(x);
    for (size_t k = 0; k < all.size(); ++k) by_image.bound(all[k], 0, sizes[k]);
    by_scale.bound(x, 0, width);
    by_shift.bound(x, 0, width);
  }

  std::vector<Func> outputs() const { return {by_image, by_scale, by_shift}; }
  std::vector<Buffer<float>> results() const {
    std::vector<int> sizes;
    for (int d = 0; d < image.dimensions(); ++d) sizes.push_back(image.dim(d).extent());
    return {Buffer<float>(sizes), Buffer<float>(width), Buffer<float>(width)};
  }
};

void run(Pipeline& pipeline, const std::vector<Buffer<float>>& results) {
  pipeline.realize(Realization(std::vector<Buffer<>>(results.begin(), results.end())));
}

// Against each sum in loops of its own; with the same bits for other numbers of threads.
template <typename Program>
void check(const Program& scheduled, const Program& plain) {
  Pipeline pipeline(scheduled.outputs()), reference(plain.outputs());
  reference.set_autoschedule({.without = {Decision::Slices}});
  const std::vector<Buffer<float>> found = scheduled.results(), expected = plain.results();
  run(pipeline, found);
  run(reference, expected);
  for (size_t i = 0; i < found.size(); ++i) expect_near(found[i], expected[i]);
  for (const int threads : {1, 3}) {
    pipeline.jit_handlers().thread_limit = threads;
    const std::vector<Buffer<float>> other = scheduled.results();
    run(pipeline, other);
    for (size_t i = 0; i < found.size(); ++i)
      EXPECT_TRUE(gradient::same_bits(found[i], other[i])) << threads << " " << i;
  }
}

TEST(RowGuests, JoinTheLoopOverGroupsWithTheAdjointThatAllRead) {
  Normalisation scheduled, other, plain;
  Pipeline(scheduled.outputs()).auto_schedule(get_host_target());
  EXPECT_EQ(guests_of(scheduled.outputs(), scheduled.by_image), 2);
  EXPECT_TRUE(is_hosted_by(scheduled.adjoint, scheduled.by_image));
  check(other, plain);
}

TEST(RowGuests, JoinTheLoopOverChannelsOfAllImages) {
  Normalisation scheduled(0), other(0), plain(0);
  Pipeline(scheduled.outputs()).auto_schedule(get_host_target());
  EXPECT_EQ(guests_of(scheduled.outputs(), scheduled.by_image), 2);
  check(other, plain);
}

// The adjoint stays at root if another Func reads it, too; sums join all the same.
TEST(RowGuests, LeaveAnAdjointAtRootThatOthersRead) {
  Normalisation scheduled;
  Func turned("turned");
  turned(x, y, c, n) = scheduled.adjoint(y, x, c, n);
  turned.bound(x, 0, 30).bound(y, 0, 30).bound(c, 0, 24).bound(n, 0, 12);
  std::vector<Func> outputs = scheduled.outputs();
  outputs.push_back(turned);
  Pipeline(outputs).auto_schedule(get_host_target());
  EXPECT_FALSE(is_hosted_by(scheduled.adjoint, scheduled.by_image));
}

// Each image of a batch is a part of the sum for a channel.
TEST(RowGuests, HavePlanesAsParts) {
  const Normalisation made;
  for (const graph::FuncPtr& f : graph::topological_order({made.by_shift.function()})) {
    if (!f->made || !f->made->has_parts || f->made->blocks > 0) continue;
    EXPECT_EQ(f->updates.size(), 1u);
    for (const graph::FuncPtr& sum : graph::topological_order({made.by_shift.function()})) {
      for (const graph::Definition& update : sum->updates) {
        if (update.rvars.size() == 2 && update.rvars[1].var.find("part") != std::string::npos)
          EXPECT_EQ(ir::as_const_int(update.rvars[1].extent), made.images);
      }
    }
  }
}

void expect_groups(const std::vector<Func>& outputs, const LayerNormalisation& program) {
  Pipeline(outputs).auto_schedule(get_host_target());
  EXPECT_EQ(guests_of(outputs, program.by_image), 2);
  EXPECT_TRUE(is_hosted_by(program.adjoint, program.by_image));
}

TEST(RowGuests, JoinTheLoopOverGroupsOfRows) {
  for (const int rows : {6144, 6007}) {  // the second is a multiple of no group
    SCOPED_TRACE(rows);
    LayerNormalisation scheduled(rows), other(rows), plain(rows);
    expect_groups(scheduled.outputs(), scheduled);
    check(other, plain);
  }
}

TEST(RowGuests, JoinTheLoopOverGroupsOfRowsWithTwoCoordinates) {
  LayerNormalisation scheduled(384, 16), other(384, 16), plain(384, 16);
  expect_groups(scheduled.outputs(), scheduled);
  check(other, plain);
}

}  // namespace
}  // namespace retrograde
