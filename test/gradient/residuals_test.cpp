// Tests which sums of a forward pass are handed to its gradient, and that the gradient has the same values when it reads
// them from images.
#include "autodiff/sweeps/residuals.h"

#include "autodiff/derivative.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"

namespace retrograde::gradient {
namespace {

std::vector<graph::FuncPtr> contents_of(const std::vector<Func>& funcs) {
  std::vector<graph::FuncPtr> result;
  for (const Func& f : funcs) result.push_back(f.function());
  return result;
}

// A log-sum-exp of each row of an image.
class Residuals : public ::testing::Test {
 protected:
  static constexpr int columns = 80, rows = 900;
  Var x{"x"}, y{"y"};
  Buffer<float> image = random_image({columns, rows}, -2, 2, 3);
  ImageParam in{Float(32), 2, "in"};
  Func largest{"largest"}, total{"total"}, out{"out"};

  void define(int terms = columns) {
    in.set(image);
    RDom r(0, terms);
    largest(y) = maximum(r, in(r, y));
    total(y) = 0.0f;
    total(y) += exp(in(r, y) - largest(y));
    out(y) = largest(y) + log(total(y));
    out.output_buffer().dim(0).set_bounds(0, rows);
  }
  Func gradient() const {
    Func seed("seed"), result("in_gradient");
    seed(y) = 1.0f + 0.001f * cast<float>(y);
    const Derivative d = propagate_adjoints(out, seed, {{0, rows}});
    result(x, y) = d(in)(x, y);
    result.output_buffer().dim(0).set_bounds(0, columns);
    result.output_buffer().dim(1).set_bounds(0, rows);
    return result;
  }
  std::vector<std::string> found(const std::vector<Func>& outputs, const Func& gradient) const {
    std::vector<std::string> names;
    for (const auto& r : autodiff::residuals_of(contents_of(outputs), contents_of({gradient})))
      names.push_back(graph::without_numbers(r.func->name));
    std::ranges::sort(names);
    return names;
  }
};

TEST_F(Residuals, AreSumsOfManyTermsThatTheGradientReads) {
  define();
  EXPECT_EQ(found({out}, gradient()), (std::vector<std::string>{"maximum", "total"}));
  EXPECT_TRUE(autodiff::may_have_residuals(contents_of({out})));
}

TEST_F(Residuals, AreNoOutputs) {
  define();
  total.output_buffer().dim(0).set_bounds(0, rows);
  EXPECT_EQ(found({out, total}, gradient()), (std::vector<std::string>{"maximum"}));
}

TEST_F(Residuals, AreNotWorthItForFewTerms) {
  define(63);
  EXPECT_EQ(found({out}, gradient()), std::vector<std::string>());
  EXPECT_FALSE(autodiff::may_have_residuals(contents_of({out})));
}

TEST_F(Residuals, LeaveScheduledProgramsAlone) {
  define();
  total.compute_root();
  EXPECT_EQ(found({out}, gradient()), std::vector<std::string>());
}

TEST_F(Residuals, AreReadFromImages) {
  define();
  const Func g = gradient();
  const Buffer<float> expected = Pipeline(g).realize({columns, rows});
  std::vector<Func> forward{out};
  std::vector<graph::FuncPtr> kept;
  std::vector<ImageParam> images;
  std::vector<std::shared_ptr<graph::ParameterContents>> parameters;
  for (const auto& r : autodiff::residuals_of(contents_of({out}), contents_of({g}))) {
    EXPECT_EQ(r.extents, std::vector<int64_t>{rows});
    forward.emplace_back(r.func);
    kept.push_back(r.func);
    images.emplace_back(Float(32), 1, "kept_" + std::to_string(images.size()));
    parameters.push_back(images.back().parameter());
  }
  const Realization results = Pipeline(forward).realize({rows});
  for (size_t i = 0; i < images.size(); ++i) images[i].set(results[i + 1]);
  const Func reading(autodiff::reading_residuals(contents_of({g}), kept, parameters)[0]);
  const Buffer<float> found = Pipeline(reading).realize({columns, rows});
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column)
      ASSERT_NEAR(found(column, row), expected(column, row), 1e-6f) << column << ", " << row;
  }
  // Nothing of the reductions is left.
  for (const graph::FuncPtr& f : graph::topological_order({reading.function()}))
    EXPECT_TRUE(f->made || f->updates.empty()) << f->name;
}

}  // namespace
}  // namespace retrograde::gradient
