// Tests the inversion of accesses (autodiff/inversion) by enumeration: over small domains, the gathers of an access
// must visit each point of the stage exactly once, at the element that it reads. They also check the shape of the
// result: the number of gathers and of their iterations.
#include "autodiff/inversion/access_inversion.h"
#include "autodiff/inversion/inversion_cost.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <random>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/scalar.h"
#include "support/errors.h"

namespace retrograde::autodiff {
namespace {

using Env = std::map<std::string, int64_t>;

// `table` represents data: any integer function of the arguments.
int64_t table(const std::vector<int64_t>& args) {
  int64_t h = 7;
  for (int64_t a : args) h = (h * 31 + a * 17 + 3) % 1009;
  return h;
}

int64_t eval(const Expr& e, const Env& env) {
  if (auto value = as_const_int(e)) return *value;
  return match(
      e, [&](const Variable& v) { return env.at(v.name); },
      [&](const Cast& c) { return eval(c.value, env); },
      [&](const Binary& b) -> int64_t {
        Type type = b.a.type().is_bool() ? Bool() : Int(64);
        auto scalar = [&](int64_t v) {
          return type.is_bool() ? Scalar::of_bool(v != 0) : Scalar::of_int(type, v);
        };
        Scalar r = eval_binary(b.kind, scalar(eval(b.a, env)), scalar(eval(b.b, env)));
        return r.type.is_bool() ? r.as_bool() : r.i;
      },
      [&](const Not& n) -> int64_t { return eval(n.a, env) == 0; },
      [&](const Select& s) {
        return eval(s.condition, env) ? eval(s.when_true, env) : eval(s.when_false, env);
      },
      [&](const Call& c) -> int64_t {
        if (c.is_op(Op::shift_left)) return eval(c.args[0], env) << eval(c.args[1], env);
        if (c.is_op(Op::shift_right)) return eval(c.args[0], env) >> eval(c.args[1], env);
        if (c.is_op(Op::bitwise_and)) return eval(c.args[0], env) & eval(c.args[1], env);
        if (c.is_op(Op::absd)) return std::abs(eval(c.args[0], env) - eval(c.args[1], env));
        if (c.call_type == CallType::Operator) return eval(c.args[0], env);
        std::vector<int64_t> args;
        for (const Expr& a : c.args) args.push_back(eval(a, env));
        return table(args) % (c.type.is_bool() ? 2 : 5);
      },
      [&](const ExprNode&) -> int64_t {
        ADD_FAILURE() << "cannot evaluate " << e;
        return 0;
      });
}

void for_box(const std::vector<std::pair<int64_t, int64_t>>& box,
             const std::function<void(const std::vector<int64_t>&)>& f) {
  std::vector<int64_t> point;
  std::function<void(size_t)> go = [&](size_t d) {
    if (d == box.size()) return f(point);
    for (int64_t v = box[d].first; v <= box[d].second; ++v) {
      point.push_back(v);
      go(d + 1);
      point.pop_back();
    }
  };
  go(0);
}

struct Case {
  AccessQuery query;
  Env params;
};

using Point = std::pair<std::vector<int64_t>, std::vector<int64_t>>;  // element, iteration

std::map<Point, int> visits_of_stage(const Case& c) {
  std::map<Point, int> visits;
  std::vector<std::pair<int64_t, int64_t>> box;
  for (const LoopVariable& v : c.query.domain.vars)
    box.emplace_back(eval(v.min, c.params), eval(v.max, c.params));
  for_box(box, [&](const std::vector<int64_t>& point) {
    Env env = c.params;
    for (size_t i = 0; i < point.size(); ++i) env[c.query.domain.vars[i].name] = point[i];
    if (c.query.domain.predicate.defined() && !eval(c.query.domain.predicate, env)) return;
    std::vector<int64_t> element;
    for (const Expr& e : c.query.indices) element.push_back(eval(e, env));
    ++visits[{element, point}];
  });
  return visits;
}

// Checks by enumeration that a reduction domain is as small as possible: some element needs its first iteration, some
// its last.
void expect_no_smaller_domain(const Gather& g, const Env& params,
                              const std::map<std::string, std::pair<int64_t, int64_t>>& used) {
  if (!g.rdom) return;
  for (const ReductionVariable& r : g.rdom->vars) {
    int64_t min = eval(r.min, params), max = min + eval(r.extent, params) - 1;
    if (!used.contains(r.var)) {
      EXPECT_FALSE(params.empty()) << r.var << " is never used";
      continue;  // with these parameters there is no such point
    }
    EXPECT_EQ(used.at(r.var), std::pair(min, max)) << r.var;
  }
}

// Visits by the gathers, including elements far outside the read region: nothing may be visited there.
std::map<Point, int> visits_of_gathers(const Case& c, const Inversion& inversion, int64_t reach,
                                       bool expect_smallest = true) {
  std::map<Point, int> visits;
  for (const Gather& g : inversion.gathers) {
    std::vector<std::pair<int64_t, int64_t>> box;
    std::vector<std::string> names;
    std::map<std::string, std::pair<int64_t, int64_t>>
        used;  // the range of each variable over visited points
    for (size_t d = 0; d < g.lhs.size(); ++d) {
      if (!g.pure[d]) continue;
      names.push_back(c.query.target_args[d]);
      box.emplace_back(-reach, reach);
    }
    if (g.rdom) {
      for (const ReductionVariable& r : g.rdom->vars) {
        names.push_back(r.var);
        int64_t min = eval(r.min, c.params);
        box.emplace_back(min, min + eval(r.extent, c.params) - 1);
      }
    }
    for_box(box, [&](const std::vector<int64_t>& point) {
      Env env = c.params;
      for (size_t i = 0; i < point.size(); ++i) env[names[i]] = point[i];
      if (g.predicate.defined() && !eval(g.predicate, env)) return;
      std::vector<int64_t> element, iteration;
      for (const Expr& e : g.lhs) element.push_back(eval(e, env));
      for (const LoopVariable& v : c.query.domain.vars)
        iteration.push_back(eval(g.iteration.at(v.name), env));
      ++visits[{element, iteration}];
      for (size_t i = 0; i < point.size(); ++i) {
        auto [it, is_new] = used.try_emplace(names[i], point[i], point[i]);
        it->second = {std::min(it->second.first, point[i]), std::max(it->second.second, point[i])};
      }
    });
    if (expect_smallest) expect_no_smaller_domain(g, c.params, used);
  }
  return visits;
}

std::string describe(const Inversion& inversion) {
  std::string out;
  for (const Gather& g : inversion.gathers) {
    out += "g_adj(";
    for (const Expr& e : g.lhs) out += print(e) + ", ";
    out += ") over ";
    if (g.rdom) {
      for (const ReductionVariable& r : g.rdom->vars) out += r.var + " < " + print(r.extent) + " ";
    }
    for (const auto& [name, e] : g.iteration) out += "\n    " + name + " = " + print(e);
    if (g.predicate.defined()) out += "\n    where " + print(g.predicate);
    out += "\n";
  }
  return out + inversion.note;
}

Expr var(const std::string& name) { return variable(name); }
const Expr x = var("x"), y = var("y"), r = var("r"), s = var("s"), c = var("c");

LoopVariable loop(const std::string& name, Expr min, Expr max, bool reduction = false) {
  return {name, std::move(min), std::move(max), reduction};
}

Case make_case(std::vector<LoopVariable> vars, std::vector<Expr> indices, Env params = {}) {
  Case result;
  result.query.domain.vars = std::move(vars);
  result.query.indices = std::move(indices);
  for (size_t d = 0; d < result.query.indices.size(); ++d)
    result.query.target_args.push_back("y" + std::to_string(d));
  result.params = std::move(params);
  return result;
}

// The number of iterations of each gather (the product of its constant extents), in order.
std::vector<int64_t> iterations(const Inversion& inversion, const Env& params) {
  std::vector<int64_t> result;
  for (const Gather& g : inversion.gathers) {
    int64_t n = 1;
    if (g.rdom) {
      for (const ReductionVariable& v : g.rdom->vars) n *= eval(v.extent, params);
    }
    result.push_back(n);
  }
  return result;
}

Inversion check(const Case& c, int64_t reach = 45) {
  Inversion inversion = invert_access(c.query);
  EXPECT_EQ(visits_of_stage(c), visits_of_gathers(c, inversion, reach)) << describe(inversion);
  if (getenv("SHOW_GATHERS")) std::cout << describe(inversion) << "\n";
  return inversion;
}

bool all_gather(const Inversion& inversion) {
  for (const Gather& g : inversion.gathers) {
    if (g.scatters) return false;
  }
  return true;
}

void expect_gathers(const Case& c, std::vector<int64_t> expected) {
  Inversion inversion = check(c);
  EXPECT_TRUE(all_gather(inversion)) << describe(inversion);
  std::vector<int64_t> found = iterations(inversion, c.params);
  std::sort(found.begin(), found.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(found, expected) << describe(inversion);
}

const LoopVariable x10 = loop("x", 0, 9), y8 = loop("y", 0, 7), r3 = loop("r", 0, 2, true);

TEST(AccessInversion, PointwiseNeedsNoReduction) { expect_gathers(make_case({x10}, {x}), {1}); }
TEST(AccessInversion, ShiftIsUndone) { expect_gathers(make_case({x10}, {x - 3}), {1}); }
TEST(AccessInversion, ConvolutionKeepsItsTaps) {
  expect_gathers(make_case({x10, r3}, {x - r}), {3});
}
TEST(AccessInversion, UpsamplingGathersFour) { expect_gathers(make_case({x10}, {x / 4}), {4}); }
TEST(AccessInversion, StridedConvolutionReducesOverTapsOfOneParity) {
  expect_gathers(make_case({x10, r3}, {2 * x + r}), {2});
}
TEST(AccessInversion, HalvedPlusTap) { expect_gathers(make_case({x10, r3}, {x / 2 + r}), {6}); }
TEST(AccessInversion, PixelShuffleIsOneToOne) {
  expect_gathers(make_case({x10, loop("c", 0, 3)}, {4 * x + c}), {1});
}
TEST(AccessInversion, BayerMosaicIsOneToOne) {
  expect_gathers(make_case({x10, y8}, {x / 2, y / 2, x % 2 + 2 * (y % 2)}), {1});
}
TEST(AccessInversion, ClampTouchesOnlyTheBorder) {
  Inversion inversion = check(make_case({loop("x", -5, 14)}, {min(max(x - 3, 0), 9)}));
  EXPECT_EQ(inversion.gathers.size(), 3u) << describe(inversion);
  int pure = 0;
  for (const Gather& g : inversion.gathers) pure += g.pure[0] && !g.rdom;
  EXPECT_EQ(pure, 1) << "the interior is a plain gather: " << describe(inversion);
}
TEST(AccessInversion, Rotation) { expect_gathers(make_case({x10, y8}, {y, 9 - x}), {1}); }
TEST(AccessInversion, Shear) { expect_gathers(make_case({x10, y8, r3}, {x + r, y - r}), {3}); }
TEST(AccessInversion, Diagonal) { expect_gathers(make_case({x10}, {x, x}), {1}); }
TEST(AccessInversion, SumOfAllRows) { expect_gathers(make_case({x10, y8}, {x}), {8}); }
TEST(AccessInversion, Transposed) { expect_gathers(make_case({x10, y8}, {y, x}), {1}); }
TEST(AccessInversion, SumOfVariables) {
  expect_gathers(make_case({x10, loop("y", 0, 3)}, {x + y}), {4});
}
TEST(AccessInversion, Modulus) { expect_gathers(make_case({loop("x", 0, 11)}, {x % 4}), {3}); }
TEST(AccessInversion, ShiftsAndMasksArePowersOfTwo) {
  auto op = [](Op name, const Expr& a, int b) { return call_op(name, Int(32), {a, Expr(b)}); };
  expect_gathers(make_case({x10}, {op(Op::shift_right, x, 2)}), {4});
  expect_gathers(make_case({x10}, {op(Op::shift_left, x, 1) + 1}), {1});
  expect_gathers(make_case({loop("x", -6, 5)}, {op(Op::bitwise_and, x, 3)}), {3});
  expect_gathers(
      make_case({loop("x", -4, 7)}, {op(Op::shift_right, x, 1), op(Op::bitwise_and, x, 1)}), {1});
  EXPECT_FALSE(all_gather(check(make_case({x10}, {op(Op::bitwise_and, x, 5)})))) << "no mask";
  EXPECT_FALSE(all_gather(check(make_case({x10}, {op(Op::bitwise_and, x, 0x7fffffff)}))))
      << "2^31 is no int32";
}
TEST(AccessInversion, ConditionsAsNumbersAreSelects) {
  EXPECT_TRUE(all_gather(check(make_case({x10}, {x + cast_to(Int(32), x > 4)}))));
}
// The index is a DAG with 2^40 paths to x.
TEST(AccessInversion, SharedPartsOfAnIndexAreFollowedOnce) {
  Expr index = x;
  for (int i = 0; i < 40; ++i) index = (index + index) / 2;
  const Inversion inversion = invert_access(make_case({x10}, {index}).query);
  EXPECT_EQ(inversion.gathers.size(), 1u);
}
TEST(AccessInversion, SelectBetweenAffineIndices) {
  Inversion inversion = check(make_case({x10}, {select(x < 5, x + 10, 5 - x)}));
  EXPECT_TRUE(all_gather(inversion));
}
TEST(AccessInversion, MirrorBorder) {
  Expr mirrored = select(x < 0, -1 - x, select(x > 9, 19 - x, x));
  Inversion inversion = check(make_case({loop("x", -4, 13)}, {mirrored}));
  EXPECT_TRUE(all_gather(inversion));
  for (int64_t n : iterations(inversion, {})) EXPECT_LE(n, 2);
}
TEST(AccessInversion, RepeatImageBorder) {
  Inversion inversion = check(make_case({loop("x", -4, 13)}, {x % 10}));
  EXPECT_TRUE(all_gather(inversion));
}
TEST(AccessInversion, BorderOfParametricSizeLeavesTheInteriorAGather) {
  Expr n = var("n");
  Case k = make_case({loop("x", -3, n + 2)},
                     {select(x < 0 || x > n - 1, x % n, clamp(x, 0, n - 1))}, {{"n", 7}});
  Inversion inversion = check(k);
  int interior = 0;
  for (const Gather& g : inversion.gathers) interior += !g.scatters && !g.rdom && g.pure[0];
  EXPECT_EQ(interior, 1) << describe(inversion);
  for (int64_t iterations : iterations(inversion, k.params))
    EXPECT_LE(iterations, 3) << describe(inversion);
}
TEST(AccessInversion, AbsoluteDifference) {
  Expr last = Expr(9);
  Expr index = last - cast(Int(32), call_op(Op::absd, UInt(32), {last, x % 18}));
  EXPECT_TRUE(all_gather(check(make_case({loop("x", -4, 13)}, {index}))));
}
TEST(AccessInversion, ParametricExtent) {
  Expr n = var("n");
  Inversion inversion = check(make_case({loop("x", 0, n - 1), r3}, {x + r}, {{"n", 7}}));
  EXPECT_EQ(iterations(inversion, {{"n", 7}}), std::vector<int64_t>{3});
}
TEST(AccessInversion, ParametricBorder) {
  Expr n = var("n");
  Case c = make_case({loop("x", 0, n + 3)}, {min(max(x - 2, 0), n - 1)}, {{"n", 7}});
  EXPECT_TRUE(all_gather(check(c)));
}
TEST(AccessInversion, ParametricBorderIsAsLongAsItsParametersSay) {
  Expr n = var("n"), m = var("m");  // m + 4 points that are clamped into n elements
  Expr across = min(max(x - 2, 0), n - 1), down = min(max(y - 2, 0), n - 1);
  Case k = make_case({loop("x", 0, m + 3), loop("y", 0, m + 3)}, {across, down});
  for (auto [size, points] : {std::pair(7, 0), {3, 20}, {1, 5}, {0, 3}}) {
    k.params = {{"n", size}, {"m", points}};
    check(k);
  }
  k.params = {{"n", 20}, {"m", 20}};
  Inversion inversion = check(k);
  int64_t steps = 0;
  for (int64_t of_border : iterations(inversion, k.params)) steps += of_border;
  EXPECT_LE(steps, 60) << "corners of 2 x 2 points in 24 x 24: " << describe(inversion);
}
TEST(AccessInversion, ParametricReduction) {
  Expr n = var("n");
  expect_gathers(make_case({x10, loop("r", 0, n - 1, true)}, {x}, {{"n", 6}}), {6});
}
TEST(AccessInversion, WholeDomainIntoOneElement) { expect_gathers(make_case({x10, y8}, {}), {80}); }
TEST(AccessInversion, FixedIndexStaysOnTheLeft) {
  Inversion inversion = check(make_case({x10}, {Expr(3), x}));
  EXPECT_FALSE(inversion.gathers[0].pure[0]);
  EXPECT_TRUE(inversion.gathers[0].pure[1]);
}
TEST(AccessInversion, InterleavedFixedChannel) {
  Inversion inversion = check(make_case({x10, loop("c", 0, 2)}, {4 * c + 1, x}));
  EXPECT_TRUE(inversion.gathers[0].pure[0]);
  EXPECT_FALSE(inversion.gathers[0].rdom);
}

Expr data(std::vector<Expr> args) { return call_image("data", Int(32), std::move(args), {}); }

TEST(AccessInversion, DataOnDeterminedVariablesIsAParameter) {
  expect_gathers(make_case({x10, y8}, {x + data({y}), y}), {1});
}
TEST(AccessInversion, ConditionOnDeterminedVariablesIsAParameter) {
  Expr flag = call_image("flag", Bool(), {y}, {});
  Expr wide = call_image("wide", UInt(32), {y}, {}) > make_const(UInt(32), 2);
  for (const Expr& c : {flag, wide, flag && !wide, flag == wide})
    expect_gathers(make_case({x10, y8}, {make_select(c, x, x + 2), y}), {1});
}
TEST(AccessInversion, DataInOneDimensionScattersThereOnly) {
  Inversion inversion = check(make_case({x10, y8, loop("c", 0, 3)}, {c, x, data({x, y})}));
  ASSERT_EQ(inversion.gathers.size(), 1u);
  EXPECT_EQ(inversion.gathers[0].pure, (std::vector<bool>{true, true, false}))
      << describe(inversion);
  EXPECT_EQ(iterations(inversion, {}), std::vector<int64_t>{8});
}
TEST(AccessInversion, DataEverywhereScatters) {
  Inversion inversion = check(make_case({x10}, {data({x})}));
  EXPECT_TRUE(inversion.gathers[0].scatters);
}
TEST(AccessInversion, DataPredicateIsKept) {
  Case c = make_case({x10, r3}, {x + r});
  c.query.domain.predicate = data({x}) > 2 && x + r > 4;
  EXPECT_TRUE(all_gather(check(c)));
}
TEST(AccessInversion, TriangularPredicate) {
  Case c = make_case({x10, loop("r", 0, 9, true)}, {r});
  c.query.domain.predicate = r <= x;
  EXPECT_TRUE(all_gather(check(c)));
}

// Bilateral slicing: the grid cell is an affine function of the pixel, clamped at the border; the depth is
// data-dependent.
TEST(AccessInversion, SlicedGridGathersPixelsOfACell) {
  const int size = 8, cells = 4;
  auto cell = [&](const Expr& v) {
    return min(max((2 * v + 1 - size) / (2 * size), 0), cells - 1);
  };
  for (int dx : {0, 1}) {
    Case k = make_case({loop("c", 0, 2), loop("x", 0, 31), loop("y", 0, 31)},
                       {c, min(cell(x) + dx, cells - 1), cell(y), data({x, y}) + dx});
    Inversion inversion = check(k, 6);
    for (const Gather& g : inversion.gathers) {
      EXPECT_TRUE(g.pure[0] && !g.pure[3]) << describe(inversion);
      EXPECT_EQ(g.rdom->vars.size(), 2u);
    }
    EXPECT_EQ(inversion.gathers.size(), 1u) << describe(inversion);
  }
}

// The bounding box of the points that read an element is far larger than their number.
TEST(AccessInversion, ScattersWhereTheInverseIsDearer) {
  Case k = make_case({loop("x", 0, 1023)}, {(3 * x) % 32 + x / 32});
  k.query.region = {loop("y0", 0, 62)};
  Inversion gathered = invert_access(k.query), chosen = invert_or_scatter(k.query);
  EXPECT_TRUE(all_gather(gathered));
  EXPECT_GT(iterations(gathered, {})[0], 256);
  ASSERT_EQ(chosen.gathers.size(), 1u);
  EXPECT_TRUE(chosen.gathers[0].scatters);
  expect_mentions(chosen.note, {"for 1024 points"});
  Case cheap = make_case({x10, r3}, {2 * x + r});
  cheap.query.region = {loop("y0", 0, 20)};
  EXPECT_FALSE(invert_or_scatter(cheap.query).gathers[0].scatters);
}

// Without a limit, the search for gathers of such an access took half a minute.
TEST(AccessInversion, ScattersWhereTheSearchTakesTooLong) {
  Case k = make_case({loop("x", 0, 63)}, {((7 * x) % 16) * 32 + (x / 3) % 32 + x % 5});
  EXPECT_EQ(k.query.operations, isl_operations);
  Inversion chosen = invert_or_scatter(k.query);
  ASSERT_EQ(chosen.gathers.size(), 1u);
  EXPECT_TRUE(chosen.gathers[0].scatters);
  EXPECT_TRUE(chosen.gave_up);
  expect_mentions(chosen.note, {"was given up"});
}

// isl stops wherever its budget ends, and a partial result must not count as an answer. The smallest budget that yields
// gathers at all must yield the right ones.
TEST(AccessInversion, IsRightWithTheLeastBudgetThatIsEnough) {
  const Expr w = var("w"), h = var("h"), p = var("p");
  Case k = make_case({loop("x", -2, 2)},
                     {max(min((2 - x) / 3 + 1, w - 1), 0), h - 1 - max(min(x + p, h - 1), 0)},
                     {{"w", 5}, {"h", 5}, {"p", 3}});
  auto with_budget = [&](unsigned long operations) {
    k.query.operations = operations;
    return invert_access(k.query);
  };
  unsigned long few = 1000, enough = 2'000'000;
  ASSERT_TRUE(with_budget(few).gathers[0].scatters);
  while (enough - few > 1) {
    const unsigned long middle = (few + enough) / 2;
    (with_budget(middle).gathers[0].scatters ? few : enough) = middle;
  }
  const Inversion least = with_budget(enough);
  ASSERT_FALSE(least.gathers[0].scatters);
  EXPECT_EQ(visits_of_gathers(k, least, 9, false), visits_of_stage(k)) << enough << " operations\n"
                                                                       << describe(least);
}

// Random quasi-affine accesses, checked by enumeration.
class RandomAccess {
 public:
  explicit RandomAccess(unsigned seed) : random_(seed) {}
  Case next() {
    std::vector<LoopVariable> vars{loop("x", pick(-3, 0), pick(4, 8)),
                                   loop("y", pick(-2, 1), pick(2, 5)),
                                   loop("r", 0, pick(0, 3), true)};
    vars.resize(static_cast<size_t>(pick(1, 3)));
    names_.clear();
    for (const auto& v : vars) names_.push_back(v.name);
    std::vector<Expr> indices;
    for (int64_t i = pick(1, 3); i > 0; --i) indices.push_back(index(3));
    Case result = make_case(vars, indices);
    if (pick(0, 2) == 0) result.query.domain.predicate = index(1) <= index(1);
    return result;
  }

 private:
  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  Expr leaf() {
    return pick(0, 4) == 0
               ? Expr(pick(-4, 4))
               : var(names_[static_cast<size_t>(pick(0, static_cast<int>(names_.size()) - 1))]);
  }
  Expr index(int depth) {
    if (depth == 0) return leaf();
    switch (pick(0, 9)) {
      case 0:
      case 1:
        return index(depth - 1) + index(depth - 1);
      case 2:
        return index(depth - 1) - index(depth - 1);
      case 3:
        return index(depth - 1) * pick(-2, 3);
      case 4:
        return index(depth - 1) / pick(2, 4);
      case 5:
        return index(depth - 1) % pick(2, 4);
      case 6:
        return min(index(depth - 1), index(depth - 1));
      case 7:
        return max(index(depth - 1), pick(-3, 3));
      case 8:
        return select(index(depth - 1) < index(depth - 1), index(depth - 1), index(depth - 1));
      default:
        return leaf();
    }
  }
  std::mt19937 random_;
  std::vector<std::string> names_;
};

TEST(AccessInversion, RandomQuasiAffineAccessesAgreeWithEnumeration) {
  for (unsigned seed = 0; seed < 120; ++seed) {
    Case k = RandomAccess(seed).next();
    std::string text;
    for (const Expr& e : k.query.indices) text += print(e) + ", ";
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + text);
    int64_t reach = 1;
    for (const auto& [point, n] : visits_of_stage(k)) {
      for (int64_t e : point.first) reach = std::max(reach, std::abs(e) + 2);
    }
    if (reach > 40) continue;
    Inversion inversion = check(k, reach);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace retrograde::autodiff
