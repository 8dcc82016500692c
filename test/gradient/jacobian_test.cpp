// Tests complete Jacobians and Hessians: dense() against central differences in double, entry by entry; band(),
// diagonal and both compressions against dense() and against products with unit vectors. Also tests numbers of colours
// against known values for the pattern, machine code, and third derivatives.
#include "autodiff/jacobian.h"

#include "autodiff/custom_derivative.h"
#include "autodiff/second_order.h"
#include "frontend/data/param.h"
#include "gradient/gradient_check.h"
#include "graph/names.h"
#include "support/errors.h"

namespace retrograde::gradient {
namespace {

using Point = std::vector<int>;

Point joined(const Point& a, const Point& b) {
  Point result = a;
  result.insert(result.end(), b.begin(), b.end());
  return result;
}
oracle::Region region_from_zero(const Point& sizes) { return {Point(sizes.size(), 0), sizes}; }

class Jacobians : public ::testing::Test {
 protected:
  static constexpr int n = 7;
  Var x{"x"}, y{"y"};
  Buffer<float> a = random_image({n}, 0.25, 1.5, 1), plane = random_image({5, 4}, 0.25, 1.5, 2);

  double at(const Func& f, const Point& point) {
    oracle::Region one{point, Point(point.size(), 1)};
    return evaluate(f, one).values[0].scalar.as_double();
  }

  // Checks dense() of f over `sizes` by `image` against differences.
  void expect_right(const Func& f, const Point& sizes, Buffer<float>& image, const Jacobian& j,
                    double tolerance = 1e-5) {
    oracle::Region rows = region_from_zero(sizes), columns = oracle::region_of(*image.raw_buffer());
    oracle::Region all{joined(rows.mins, columns.mins), joined(rows.extents, columns.extents)};
    oracle::Array found = evaluate(j.dense(), all);
    columns.for_each([&](const Point& column) {
      float& element = image.get()->operator()(column.data());
      const float center = element;
      auto values = [&](float h) {
        element = center + h;
        oracle::Array result = evaluate(f, rows);
        element = center;
        return result;
      };
      oracle::Array up = values(1.0f / 256), down = values(-1.0f / 256),
                    far_up = values(1.0f / 128), far_down = values(-1.0f / 128);
      rows.for_each([&](const Point& row) {
        auto slope = [&](const oracle::Array& u, const oracle::Array& d, double h) {
          return (u.at(row).scalar.as_double() - d.at(row).scalar.as_double()) / (2 * h);
        };
        double expected = (4 * slope(up, down, 1.0 / 256) - slope(far_up, far_down, 1.0 / 128)) / 3;
        double actual = found.at(joined(row, column)).scalar.as_double();
        EXPECT_NEAR(actual, expected, tolerance * (1 + std::abs(expected)))
            << ::testing::PrintToString(row) << " by " << ::testing::PrintToString(column);
      });
    });
    if (!::testing::Test::HasFailure()) expect_machine_code_agrees(j.dense(), all);
  }
  void expect_band_agrees(const Jacobian& j, const Point& sizes) {
    oracle::Region rows = region_from_zero(sizes);
    Region offsets = j.band_offsets();
    Point mins, extents;
    for (const Range& r : offsets) {
      mins.push_back(static_cast<int>(*ir::as_const_int(r.min)));
      extents.push_back(static_cast<int>(*ir::as_const_int(r.extent)));
    }
    region_from_zero(extents).for_each([&](const Point& k) {
      rows.for_each([&](const Point& row) {
        Point column = row;
        for (size_t d = 0; d < row.size(); ++d) column[d] += mins[d] + k[d];
        EXPECT_EQ(at(j.band(), joined(row, k)), at(j.dense(), joined(row, column)));
      });
    });
  }
};

TEST_F(Jacobians, OfAPointwiseFuncHaveOneColour) {
  Func f("f");
  f(x) = sin(a(x)) * a(x);
  Jacobian j = jacobian(f, a, {{0, n}});
  EXPECT_EQ(j.colours(), 1);
  expect_right(f, {n}, a, j);
  expect_band_agrees(j, {n});
}

TEST_F(Jacobians, OfAThreePointStencilHaveThree) {
  Func f("f");
  f(x) = a(x) * a(x + 1) + exp(a(x + 2));
  Jacobian j = jacobian(f, a, {{0, n - 2}});
  EXPECT_EQ(j.colours(), 3);
  EXPECT_FALSE(j.by_rows());
  expect_right(f, {n - 2}, a, j);
  expect_band_agrees(j, {n - 2});
  EXPECT_EQ(graph::without_numbers(j.explain()),
            "tangents for 3 seeds in \"f_tan_by_colour\": elements of one colour share no row\n");
}

TEST_F(Jacobians, OfTheFivePointStencilHaveFive) {
  Func f("f"), g("g");
  g(x, y) = plane(x, y) * plane(x, y);
  f(x, y) = g(x, y + 1) + g(x + 1, y) * g(x + 1, y + 1) + g(x + 2, y + 1) + g(x + 1, y + 2);
  EXPECT_EQ(jacobian(f, plane, {{0, 30}, {0, 20}}).colours(), 5);
  Jacobian j = jacobian(f, plane, {{0, 3}, {0, 2}});
  EXPECT_EQ(j.colours(), 4);  // so few rows have fewer conflicts
  expect_right(f, {3, 2}, plane, j);
  expect_band_agrees(j, {3, 2});
}

TEST_F(Jacobians, OfABoxStencilHaveAsManyAsTheBox) {
  Func f("f");
  RDom r(0, 3, 0, 2);
  f(x, y) = 0.0f;
  f(x, y) += plane(x + r.x, y + r.y) * plane(x + r.x, y + r.y) * cast<float>(r.x + 2 * r.y + 1);
  Jacobian j = jacobian(f, plane, {{0, 3}, {0, 3}});
  EXPECT_EQ(j.colours(), 6);
  expect_right(f, {3, 3}, plane, j);
}

TEST_F(Jacobians, OfDownsamplingHaveThoseOfABlockOrOne) {
  Func f("f");
  f(x) = a(2 * x) * a(2 * x + 1);
  Jacobian j = jacobian(f, a, {{0, 3}}, {.compression = Compression::Columns});
  EXPECT_EQ(j.colours(), 2);
  expect_right(f, {3}, a, j);
  Jacobian rows = jacobian(f, a, {{0, 3}});  // no two outputs read one element
  EXPECT_TRUE(rows.by_rows());
  EXPECT_EQ(rows.colours(), 1);
  expect_right(f, {3}, a, rows);
}

// The Tuple's value index is one more dimension of the input; a value that is not read costs no colour.
TEST_F(Jacobians, ByATupleHaveItsValuesAsOneMoreDimension) {
  Func pair("pair"), f("f");
  pair(x) = Tuple(a(x) + 1.0f, 7, 2.0f * a(x));
  f(x) = pair(x)[0] * pair(x + 1)[0] * pair(x)[2];
  auto expected = [&](int y, int at, int value) {
    float p = a(y) + 1, q = a(y + 1) + 1, r = 2 * a(y);
    return value == 0 ? (at == y       ? q * r
                         : at == y + 1 ? p * r
                                       : 0.0f)
                      : (value == 2 && at == y ? p * q : 0.0f);
  };
  for (Compression c : {Compression::Columns, Compression::Rows}) {
    Jacobian j = jacobian(f, pair, {{0, n - 1}}, {.compression = c});
    EXPECT_LE(j.colours(), 4);
    for (int y = 0; y < n - 1; ++y) {
      for (int at = 0; at < n; ++at) {
        for (int value = 0; value < 3; ++value)
          EXPECT_NEAR(this->at(j.dense(), {y, at, value}), expected(y, at, value), 1e-5);
      }
    }
    expect_machine_code_agrees(j.dense(), {{0, 0, 0}, {n - 1, n, 3}});
  }
  Func g("g");
  g(x) = sin(pair(x)[2]);
  EXPECT_EQ(jacobian(g, pair, {{0, n}}).colours(), 1);
}

TEST_F(Jacobians, HessiansByATupleHaveBlocksOfItsValues) {
  Func pair("pair"), loss("loss");
  RDom r(0, n - 1);
  pair(x) = Tuple(a(x), a(x) * a(x));
  loss() = 0.0f;
  loss() += pair(r)[0] * pair(r)[0] * pair(r + 1)[1];
  Jacobian h = hessian(loss, pair);
  HessianDiagonal d = hessian_diagonal(loss, pair);
  // 2 p(i + 1)[1] at ((i, 0), (i, 0)); 2 p(i)[0] at ((i, 0), (i + 1, 1)) and its transpose.
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 2; ++k) {
      for (int j = 0; j < n; ++j) {
        for (int l = 0; l < 2; ++l) {
          float expected = 0;
          if (k == 0 && l == 0 && i == j && i < n - 1) expected = 2 * a(i + 1) * a(i + 1);
          if (k == 0 && l == 1 && j == i + 1) expected = 2 * a(i);
          if (k == 1 && l == 0 && i == j + 1) expected = 2 * a(j);
          EXPECT_NEAR(at(h.dense(), {i, k, j, l}), expected, 1e-5);
          if (i == j && k == l) {
            EXPECT_NEAR(at(d.diagonal, {i, k}), expected, 1e-5);
          }
        }
      }
    }
  }
  EXPECT_LE(d.colours, h.colours());
  EXPECT_LE(h.colours(), 6);
}

TEST_F(Jacobians, OfBordersStayNarrow) {
  Func g = BoundaryConditions::repeat_edge(a), f("f");
  f(x) = g(x - 1) * g(x) + g(x + 1);
  Jacobian j = jacobian(f, a, {{0, n}});
  EXPECT_EQ(j.colours(), 3);
  expect_right(f, {n}, a, j);
}

// The pattern of mirrored borders has pieces without integer points: isl 0.25 crashes when it joins them.
TEST_F(Jacobians, OfMirroredBorders) {
  Buffer<float> wide = random_image({10}, 0.25, 1.5, 3);
  wide.set_min({-2});
  Func around("around"), f("f");
  around(x) = wide(x - 2) + wide(x);
  f(x) = BoundaryConditions::mirror_image(around, {{0, 4}})(x + 3) * around(x + 3);
  expect_right(f, {5}, wide, jacobian(f, wide, {{0, 5}}));
  Func narrow("narrow");
  narrow(x) = BoundaryConditions::mirror_image(around, {{0, 3}})(x + 3) + around(x + 3);
  expect_right(narrow, {5}, wide, jacobian(narrow, wide, {{0, 5}}));
}

TEST_F(Jacobians, TakeRowsWhereOutputsAreFewer) {
  Func f("f");
  RDom r(0, n);
  f(x) = 0.0f;
  f(x) += a(r) * a(r) * cast<float>(r + x);
  Jacobian rows = jacobian(f, a, {{0, 2}});
  EXPECT_TRUE(rows.by_rows());
  EXPECT_EQ(rows.colours(), 2);
  expect_right(f, {2}, a, rows);
  Jacobian columns = jacobian(f, a, {{0, 2}}, {.compression = Compression::Columns});
  EXPECT_FALSE(columns.by_rows());
  EXPECT_EQ(columns.colours(), n);
  expect_right(f, {2}, a, columns);
}

TEST_F(Jacobians, RowsOfAStencil) {
  Func f("f");
  f(x) = a(x) * a(x + 1) + exp(a(x + 2));
  Jacobian j = jacobian(f, a, {{0, n - 2}}, {.compression = Compression::Rows});
  EXPECT_TRUE(j.by_rows());
  EXPECT_EQ(j.colours(), 3);
  expect_right(f, {n - 2}, a, j);
  expect_band_agrees(j, {n - 2});
}

TEST_F(Jacobians, OfDataDependentPlacesAreDense) {
  Buffer<int> index(4);
  for (int i = 0; i < 4; ++i) index(i) = (3 * i + 1) % n;
  Func f("f");
  f(x) = a(clamp(index(x), 0, n - 1)) * a(clamp(index(x) + 1, 0, n - 1));
  Jacobian j = jacobian(f, a, {{0, 4}}, {.compression = Compression::Columns});
  EXPECT_EQ(j.colours(), n);
  expect_right(f, {4}, a, j);
  EXPECT_EQ(jacobian(f, a, {{0, 4}}).colours(), 4);
}

TEST_F(Jacobians, OfScansAreDenseAlongTheScan) {
  Func f("f");
  RDom r(1, 4);
  f(x, y) = plane(x, y);
  f(r, y) = f(r, y) * f(r - 1, y) + f(r - 1, y);
  Jacobian j = jacobian(f, plane, {{0, 5}, {0, 4}}, {.compression = Compression::Columns});
  EXPECT_EQ(j.colours(), 5);
  expect_right(f, {5, 4}, plane, j);
}

TEST_F(Jacobians, OfHistogramsAndParameters) {
  Param<float> gain("gain");
  gain.set(0.75f);
  Func f("f"), g("g");
  RDom r(0, n);
  f(x) = 0.0f;
  f(clamp(cast<int>(a(r) * 3.0f), 0, 4)) += a(r) * gain * gain;
  Jacobian by_gain = jacobian(f, gain, {{0, 5}});
  EXPECT_EQ(by_gain.colours(), 1);
  double total = 0, expected = 0;
  for (int i = 0; i < 5; ++i) total += at(by_gain.dense(), {i});
  for (int i = 0; i < n; ++i) expected += 1.5 * a(i);
  EXPECT_NEAR(total, expected, 1e-12);
  expect_right(f, {5}, a, jacobian(f, a, {{0, 5}}), 1e-4);
}

TEST_F(Jacobians, ByFuncsAndOfTuples) {
  Func g("g"), f("f"), first("first");
  g(x) = a(x) * 2.0f;
  f(x) = Tuple(g(x) * g(x + 1), cast<int>(x), sin(g(x)));
  Jacobian j = jacobian(f, g, {{0, 4}});
  EXPECT_EQ(j.colours(), 2);
  Func second("second");
  first(x, y) = j.dense()(x, y)[0];
  second(x, y) = j.dense()(x, y)[2];
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 5; ++k) {
      double left = k == i ? 2.0 * a(i + 1) : k == i + 1 ? 2.0 * a(i) : 0;
      EXPECT_NEAR(at(first, {i, k}), left, 1e-12);
      EXPECT_NEAR(at(second, {i, k}), k == i ? std::cos(2.0 * a(i)) : 0, 1e-12);
    }
  }
}

TEST_F(Jacobians, OfExtentsKnownAtRunTimeOnly) {
  ImageParam image(Float(32), 1, "image");
  Func f("f");
  f(x) = image(x) * image(x + 1) - image(x + 2);
  Jacobian j = jacobian(f, image, {{0, image.width() - 2}});
  EXPECT_EQ(j.colours(), 3);
  image.set(a);
  expect_right(f, {n - 2}, a, j);
}

TEST_F(Jacobians, WithoutAPathAreZero) {
  Buffer<float> b = random_image({n}, 0.25, 1.5, 3);
  Func f("f");
  f(x) = a(x) + cast<float>(cast<int>(b(x)));
  Jacobian j = jacobian(f, b, {{0, n}});
  EXPECT_EQ(j.colours(), 1);
  EXPECT_EQ(at(j.dense(), {2, 2}), 0.0);
  EXPECT_EQ(j.explain(),
            "identically zero: no differentiable path leads from the input to the output\n");
}

// ---- Hessians ----

class SparseHessians : public Jacobians {
 protected:
  Func summed(const Func& f, int size) {
    Func loss("loss");
    RDom r(0, size);
    loss() = 0.0f;
    loss() += f(r);
    return loss;
  }
  void expect_hessian(const Func& loss, Buffer<float>& image, int colours) {
    Func gradient =
        propagate_adjoints(loss, {.overwritten = Overwritten::Store, .wrt = {image}})(image);
    Jacobian h = hessian(loss, image);
    EXPECT_EQ(h.colours(), colours);
    oracle::Region all = oracle::region_of(*image.raw_buffer());
    expect_right(gradient, all.extents, image, h);
    HessianDiagonal d = hessian_diagonal(loss, image);
    EXPECT_LE(d.colours, colours);
    all.for_each([&](const Point& p) {
      EXPECT_NEAR(at(d.diagonal, p), at(h.dense(), joined(p, p)), 1e-12);
    });
    expect_machine_code_agrees(d.diagonal, all);
  }
};

TEST_F(SparseHessians, OfSeparableLossesHaveOneColour) {
  Func f("f");
  f(x) = sin(a(x)) * exp(a(x));
  expect_hessian(summed(f, n), a, 1);
}

TEST_F(SparseHessians, OfChainsAreTridiagonal) {
  Func f("f");
  f(x) = sin(a(x) * a(x + 1)) + a(x) * a(x);
  Func loss = summed(f, n - 1);
  expect_hessian(loss, a, 3);
  EXPECT_EQ(hessian_diagonal(loss, a).colours, 2);
  Jacobian h = hessian(loss, a);
  expect_band_agrees(h, {n});
  Region offsets = h.band_offsets();
  EXPECT_EQ(ir::print(offsets[0].min), "-1");
  EXPECT_EQ(ir::print(offsets[0].extent), "3");
}

TEST_F(SparseHessians, OfDenseLossesHaveAColourAnElement) {
  Func total("total"), loss("loss");
  RDom r(0, n);
  total() = 0.0f;
  total() += a(r) * cast<float>(r + 1);
  loss() = total() * total() * 0.25f + sin(total());
  expect_hessian(loss, a, n);
}

// One element interacts with all others: as columns they all conflict in its row, in a star colouring they do not.
TEST_F(SparseHessians, OfArrowsHaveTwoColours) {
  Func f("f");
  f(x) = sin(a(Expr(0)) * a(x)) + exp(a(x)) * a(x);
  Func loss = summed(f, n);
  expect_hessian(loss, a, 2);
  oracle::Array entries = evaluate(hessian(loss, a).dense(), region_from_zero({n, n}));
  EXPECT_NE(entries.at({0, 5}).scalar.as_double(), 0.0);
  EXPECT_EQ(entries.at({4, 5}).scalar.as_double(), 0.0);
}

// A custom rule's "second derivatives" need not be symmetric: then no entry may be read off its transpose.
TEST_F(SparseHessians, OfRulesReadEachEntryInItsRow) {
  Func f("f");
  f(x) = a(Expr(0)) * a(x);
  Func loss = summed(f, n);
  Buffer<float> input = a;
  auto adjoint = [input](const AdjointContext& c) {
    Func adj("a_adj");
    Var i;
    adj(i) = c.adjoint()(i) * input(Expr(0)) * input(Expr(0)) * input(clamp(i, 0, n - 1));
    return std::vector<AdjointContribution>{{input, adj}};
  };
  custom_adjoint(f, {a}, adjoint);
  Jacobian h = hessian(loss, a);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      double expected = (i == j ? 1.0 * a(0) * a(0) : 0.0) + (j == 0 ? 2.0 * a(0) * a(i) : 0.0);
      EXPECT_NEAR(at(h.dense(), {i, j}), expected, 1e-12);
    }
  }
}

TEST_F(SparseHessians, OfPlanes) {
  Func f("f"), loss("loss");
  f(x, y) = pow(plane(x + 1, y) - plane(x, y), 2) * pow(plane(x, y + 1) - plane(x, y), 2);
  RDom r(0, 4, 0, 3);
  loss() = 0.0f;
  loss() += f(r.x, r.y);
  expect_hessian(loss, plane, 6);  // a star colouring: a linear form takes 7
  EXPECT_EQ(hessian_diagonal(loss, plane).colours, 3);
}

TEST_F(SparseHessians, AgreeWithProductsAlongUnitVectors) {
  Func f("f"), unit("unit");
  f(x) = tanh(a(x) + a(x + 1) * a(x + 2));
  Func loss = summed(f, n - 2);
  Jacobian h = hessian(loss, a);
  Param<int> which("which");
  unit(x) = select(x == which, 1.0f, 0.0f);
  Func product = hessian_vector_product(loss, a, {{a, unit}});
  for (int j = 0; j < n; ++j) {
    which.set(j);
    for (int i = 0; i < n; ++i) EXPECT_NEAR(at(h.dense(), {i, j}), at(product, {i}), 1e-12);
  }
  EXPECT_EQ(h.colours(), 5);
}

TEST_F(SparseHessians, AreDifferentiatedAgain) {
  Func f("f");
  f(x) = sin(a(x) * a(x + 1));
  Func loss = summed(f, n - 1), dense = hessian(loss, a).dense();
  Func third = propagate_tangents(dense, {{a, a}})(dense);
  oracle::Region all = region_from_zero({n, n});
  oracle::Array found = evaluate(third, all);
  Buffer<float> kept = a.copy();
  auto moved = [&](float h) {
    for (int i = 0; i < n; ++i) a(i) = kept(i) + h * kept(i);
    return evaluate(dense, all);
  };
  oracle::Array up = moved(1.0f / 256), down = moved(-1.0f / 256);
  for (size_t i = 0; i < found.values.size(); ++i) {
    double slope = (up.values[i].scalar.as_double() - down.values[i].scalar.as_double()) * 128;
    EXPECT_NEAR(found.values[i].scalar.as_double(), slope, 1e-3 * (1 + std::abs(slope)));
  }
}

TEST_F(SparseHessians, BlocksBetweenInputs) {
  Buffer<float> b = random_image({n}, 0.25, 1.5, 4);
  Param<float> gain("gain");
  gain.set(0.75f);
  Func f("f");
  f(x) = sin(a(x) * b(x)) + a(x) * b(x + 1) * gain * gain;
  Func loss = summed(f, n - 1);
  Jacobian h = hessian(loss, a, b), scalar = hessian(loss, gain), mixed = hessian(loss, a, gain);
  EXPECT_EQ(h.colours(), 2);
  expect_right(propagate_adjoints(loss, {.wrt = {a}})(a), {n}, b, h);
  double twice = 0;
  for (int i = 0; i < n - 1; ++i) {
    twice += 2.0 * a(i) * b(i + 1);
    EXPECT_NEAR(at(mixed.dense(), {i}), 1.5 * b(i + 1), 1e-12);
  }
  EXPECT_NEAR(at(scalar.dense(), {}), twice, 1e-12);
  EXPECT_NEAR(at(hessian_diagonal(loss, gain).diagonal, {}), twice, 1e-12);
}

// With a rule for adjoints alone, only rows can be computed.
TEST_F(Jacobians, OfCustomAdjointsGoByRows) {
  Func g("g"), f("f");
  g(x) = floor(a(x));
  f(x) = g(x) * g(x + 1);
  Buffer<float> input = a;
  custom_adjoint(g, {a}, [input](const AdjointContext& c) {
    return std::vector<AdjointContribution>{{input, c.adjoint()}};
  });
  Jacobian j = jacobian(f, a, {{0, 4}});
  EXPECT_TRUE(j.by_rows());
  EXPECT_EQ(j.colours(), 2);
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 5; ++k) {
      double expected = k == i ? std::floor(a(i + 1)) : k == i + 1 ? std::floor(a(i)) : 0;
      EXPECT_EQ(at(j.dense(), {i, k}), expected);
    }
  }
  EXPECT_THROW(jacobian(f, a, {{0, 4}}, {.compression = Compression::Columns}), Unsupported);
}

// ---- errors ----

// rule: what to differentiate by must be defined
// rule: the output needs bounds in each of its dimensions
TEST_F(Jacobians, Errors) {
  Func undefined("undefined"), whole("whole"), f("f"), pair("pair");
  Param<int> count("count");
  whole(x) = x;
  f(x) = a(x) * cast<float>(count);
  pair(x) = Tuple(a(x), a(x));
  expect_error({"make the Jacobian", "no definition"}, [&] { jacobian(undefined, a, {}); });
  expect_error({"its type is int32"}, [&] { jacobian(whole, a, {{0, 4}}); });
  expect_error({"1 dimensions and 0 bounds"}, [&] { jacobian(f, a, {}); });
  expect_error({"has type int32"}, [&] { jacobian(f, count, {{0, 4}}); });
  expect_error({"has no definition"}, [&] { jacobian(f, undefined, {{0, 4}}); });
  expect_error<Unsupported>({"of one value", "Compression::Columns"}, [&] {
    jacobian(pair, a, {{0, 4}}, {.compression = Compression::Rows});
  });
  Jacobian j = jacobian(f, a, {{0, 4}});
  expect_error({"2 of 1 are given"}, [&] { j.colour({x, x}); });
  Func scalar("scalar");
  scalar() = a(0) * a(1);
  expect_error({"constant offsets", "dense()"}, [&] { jacobian(scalar, a, {}).band(); });
  expect_error({"make the Hessian", "has type int32"}, [&] { hessian(scalar, count); });
  expect_error({"has no definition"}, [&] { hessian_diagonal(scalar, undefined); });
}

TEST_F(Jacobians, WithoutBoundsAreRefused) {
  ImageParam image(Float(32), 1, "image");
  Param<int> length("length");
  Func f("f"), big("big");
  RDom r(0, length);
  f(x) = 0.0f;
  f(x) += image(r) * image(r) * cast<float>(x);
  expect_error<Unsupported>({"compress", "constant bounds"}, [&] {
    jacobian(f, image, {{0, length}});
  });
  RDom s(0, 5000);
  big(x) = 0.0f;
  big(x) += image(s) * image(s) * cast<float>(x + s);
  expect_error<Unsupported>({"4096 seeds", "needs more"}, [&] {
    jacobian(big, image, {{0, 5000}});
  });
}

}  // namespace
}  // namespace retrograde::gradient
