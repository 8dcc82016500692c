// Func::in, clone_in and ImageParam::in: which Funcs read which wrappers in the compiled pipeline.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>
#include <algorithm>

#include "graph/copy_graph.h"
#include "graph/definitions/define.h"
#include "graph/directives/wrappers.h"
#include "graph/graph.h"
#include "ir/visit.h"
#include "support/errors.h"

namespace retrograde {
namespace {

// The names of the Funcs and images that `reader` reads in the graph compiled for `output`.
std::vector<std::string> read_by(const Func& output, const std::string& reader) {
  const auto outputs = graph::apply_wrappers({output.function()});
  for (const graph::FuncPtr& f : graph::topological_order(outputs)) {
    if (f->name != reader) continue;
    std::vector<std::string> names;
    for (const graph::FuncPtr& callee : graph::direct_callees(*f)) names.push_back(callee->name);
    return names;
  }
  return {"no such Func"};
}

using Names = std::vector<std::string>;

// Whether the images are there that the Funcs of the graph read.
bool has_all_images(const std::vector<graph::FuncPtr>& outputs) {
  bool has_all = true;
  for (const graph::FuncPtr& f : graph::topological_order(outputs)) {
    graph::walk(*f, [&](const ir::Call& call) {
      if (call.call_type == ir::CallType::Image) has_all &= call.symbol.lock() != nullptr;
    });
  }
  return has_all;
}

// An image owns the Func that it converts to, which others read.
TEST(FuncsOfImages, KeepTheImageInCopiesAndParsedGraphs) {
  std::vector<graph::FuncPtr> copied, wrapped, parsed;
  {
    ImageParam image(Float(32), 1, "converted");
    Var x("x");
    Func reader = image, f("f");
    f(x) = reader(x) + 1;
    copied = graph::copy_graph({f.function()}).outputs;
    parsed = graph::parse_graph(graph::to_text(graph::graph_of({f.function()}))).outputs;
    reader.compute_root();
    wrapped = graph::apply_wrappers({f.function()});
  }
  EXPECT_TRUE(has_all_images(copied));
  EXPECT_TRUE(has_all_images(parsed));
  EXPECT_TRUE(has_all_images(wrapped));
}

struct Wrappers : testing::Test {
  Func f, g, h;
  Var x{"x"}, y{"y"};
  Wrappers() {
    f(x, y) = x * 3 + y;
    g(x, y) = f(x, y) + f(x + 1, y);
    h(x, y) = f(x, y) * g(x, y);
  }
  // Expects the values of h without wrappers.
  void expect_right(int w = 9, int height = 7) {
    const Buffer<int> result = h.realize({w, height});
    result.for_each_element([&](int i, int j) {
      ASSERT_EQ(result(i, j), (i * 3 + j) * ((i * 3 + j) + ((i + 1) * 3 + j)));
    });
  }
};

TEST_F(Wrappers, OneUser) {
  Func w = f.in(g);
  EXPECT_EQ(read_by(h, g.name()), Names{w.name()});
  EXPECT_EQ(read_by(h, w.name()), Names{f.name()});
  EXPECT_EQ(read_by(h, h.name()), (Names{f.name(), g.name()}));
  EXPECT_EQ(graph::direct_callees(*g.function())[0]->name,
            f.name());  // the user's Func is unchanged
  f.compute_root();
  g.compute_root();
  w.compute_at(g, y).vectorize(x, 4);
  expect_right();
}

TEST_F(Wrappers, TheSameForTheSameUser) {
  EXPECT_TRUE(f.in(g).same_as(f.in(g)));
  EXPECT_FALSE(f.in(g).same_as(f.in(h)));
  EXPECT_TRUE(f.in().same_as(f.in()));
}

TEST_F(Wrappers, GlobalAndCustom) {
  Func own = f.in(g), all = f.in();
  EXPECT_EQ(read_by(h, g.name()), Names{own.name()});
  EXPECT_EQ(read_by(h, h.name()), (Names{all.name(), g.name()}));
  EXPECT_EQ(read_by(h, own.name()), Names{f.name()});
  EXPECT_EQ(read_by(h, all.name()), Names{f.name()});
  all.compute_root();
  own.compute_root();
  expect_right();
}

TEST_F(Wrappers, SharedByTwo) {
  Func w = f.in({g, h});
  EXPECT_EQ(read_by(h, g.name()), Names{w.name()});
  EXPECT_EQ(read_by(h, h.name()), (Names{w.name(), g.name()}));
  EXPECT_TRUE(f.in({h, g}).same_as(w));
  w.compute_root();
  expect_right();
}

TEST_F(Wrappers, WrappersOfWrappers) {
  Func first = f.in(g), second = first.in(g), third = second.in();
  EXPECT_EQ(read_by(h, g.name()), Names{third.name()});
  EXPECT_EQ(read_by(h, third.name()), Names{second.name()});
  EXPECT_EQ(read_by(h, second.name()), Names{first.name()});
  EXPECT_EQ(read_by(h, first.name()), Names{f.name()});
  first.compute_root();
  third.compute_root();
  expect_right();
}

TEST_F(Wrappers, CloneComputesAgain) {
  f.compute_root();
  Func clone = f.clone_in(g);
  EXPECT_EQ(read_by(h, g.name()), Names{clone.name()});
  EXPECT_TRUE(read_by(h, clone.name()).empty());
  clone.compute_at(g, y);
  g.compute_root();
  expect_right();
}

TEST_F(Wrappers, CloneOfAReduction) {
  Func sum("sum"), a("a"), b("b");
  RDom r(0, 5);
  sum(x) = x;
  sum(x) += r * x;
  a(x) = sum(x) + 1;
  b(x) = sum(x) + a(x);
  sum.compute_root();
  sum.clone_in(a).compute_root();
  EXPECT_EQ(read_by(b, a.name()), Names{sum.clone_in(a).name()});
  const Buffer<int> result = b.realize({6});
  for (int i = 0; i < 6; i++) EXPECT_EQ(result(i), 2 * (i + 10 * i) + 1);
}

TEST_F(Wrappers, UpdatesOfTheUserReadTheWrapper) {
  Func k("k");
  RDom r(0, 4);
  k(x, y) = f(x, y);
  Func w = f.in(k);
  k(x, r) += f(x, r);  // called after the wrapper exists
  w.compute_root();
  EXPECT_EQ(read_by(k, k.name()), Names{w.name()});
  const Buffer<int> result = k.realize({3, 6});
  EXPECT_EQ(result(2, 3), 2 * (2 * 3 + 3));
  EXPECT_EQ(result(2, 5), 2 * 3 + 5);
}

TEST_F(Wrappers, TuplesAreWrappedWhole) {
  Func t("t"), s("s");
  t(x) = Tuple(x, cast<float>(x) * 0.5f);
  s(x) = cast<float>(t(x)[0]) + t(x + 1)[1];
  t.in(s).compute_root();
  t.compute_root();
  const Buffer<float> result = s.realize({5});
  for (int i = 0; i < 5; i++) EXPECT_EQ(result(i), i + (i + 1) * 0.5f);
}

TEST_F(Wrappers, AnImageIsStaged) {
  ImageParam image(Int(32), 2, "image");
  Func s("s");
  s(x, y) = image(x, y) + image(x + 1, y);
  Func w = image.in(s);
  EXPECT_EQ(read_by(s, s.name()), Names{w.name()});
  EXPECT_TRUE(image.in(s).same_as(w));
  w.compute_at(s, y).vectorize(Var("_0"), 4, TailStrategy::GuardWithIf);
  Buffer<int> data(9, 4);
  data.for_each_element([&](int i, int j) { data(i, j) = i * j + i; });
  image.set(data);
  const Buffer<int> result = s.realize({8, 4});
  for (int j = 0; j < 4; j++)
    for (int i = 0; i < 8; i++) ASSERT_EQ(result(i, j), data(i, j) + data(i + 1, j));
}

TEST_F(Wrappers, TheFuncOfAnImageIsOne) {
  ImageParam image(Int(32), 1, "image");
  EXPECT_TRUE(Func(image).same_as(Func(image)));
  Func s("s");
  s(x) = image(x) * 2;
  Func(image).compute_root();
  EXPECT_EQ(read_by(s, s.name()), Names{Func(image).name()});
  Buffer<int> data(5);
  for (int i = 0; i < 5; i++) data(i) = i;
  image.set(data);
  EXPECT_EQ(Buffer<int>(s.realize({5}))(4), 8);
}

TEST_F(Wrappers, AWrapperGivenAfterCompilingTakesEffect) {
  expect_right();
  const std::string before = h.loop_nest();
  f.in(g).compute_root();
  EXPECT_NE(h.loop_nest(), before);
  expect_right();
}

// A wrapper's handle keeps the wrapped Func alive; there is no reference cycle.
TEST_F(Wrappers, Ownership) {
  std::weak_ptr<graph::FuncContents> wrapped, wrapper;
  {
    Func out("out");
    {
      Func inner("inner");
      inner(x) = x + 5;
      Func w = inner.in();
      wrapped = inner.function();
      wrapper = w.function()->weak_from_this();
      out(x) = w(x) * 2;
    }
    EXPECT_FALSE(wrapped.expired());
    EXPECT_EQ(Buffer<int>(out.realize({3}))(2), 14);
  }
  EXPECT_TRUE(wrapped.expired());
  EXPECT_TRUE(wrapper.expired());
}

TEST_F(Wrappers, RefusesAUserThatDoesNotRead) {
  Func k("k");
  k(x, y) = x;
  f.in(k).compute_root();
  Func out("out");
  out(x, y) = h(x, y) + k(x, y);
  expect_error({"wrap", "\"k", "reads", "nothing in", "Name a Func that reads it"}, [&] {
    out.realize({3, 3});
  });
  Func complete("complete");  // another Func uses it: no update can follow
  complete(x, y) = y;
  Func user("user");
  user(x, y) = complete(x, y);
  expect_error({"wrap", "\"complete", "nothing in"}, [&] { f.in(complete); });
}

TEST_F(Wrappers, AWrapperInAnotherPipelineIsLeftAlone) {
  Func k("k");
  k(x, y) = f(x, y);
  f.in(k).compute_root();
  expect_right();
}

// Two consumers of an image, one of which reads a copy laid out in columns.
struct CopiedInput : testing::Test {
  ImageParam image{Int(32), 2, "image"};
  Buffer<int> table{8};
  Func turned{"turned"}, plain{"plain"};
  Var x{"x"}, y{"y"};
  CopiedInput() {
    for (int i = 0; i < 8; ++i) table(i) = 100 * i;
    turned(x, y) = image(y, x) + table(x % 8);
    plain(x, y) = image(x, y) + turned(x, y);
  }
  void expect_right() {
    Buffer<int> data(9, 9);
    data.for_each_element([&](int i, int j) { data(i, j) = i * i + 31 * j; });
    image.set(data);
    const Buffer<int> result = plain.realize({9, 9});
    result.for_each_element(
        [&](int i, int j) { ASSERT_EQ(result(i, j), data(i, j) + data(j, i) + table(i % 8)); });
  }
};

TEST_F(CopiedInput, IsReadByItsReaderAlone) {
  Func copy = turned.copy_input(image);
  turned.compute_root();
  copy.compute_at(turned, y).reorder_storage({copy.args()[1], copy.args()[0]});
  EXPECT_EQ(read_by(plain, turned.name()), Names{copy.name()});
  EXPECT_EQ(read_by(plain, plain.name()), Names{turned.name()});
  EXPECT_TRUE(read_by(plain, copy.name()).empty());
  EXPECT_TRUE(turned.copy_input(image).same_as(copy));
  expect_right();
}

TEST_F(CopiedInput, OfABufferThatTheProgramNames) {
  Func copy = turned.copy_input(table);
  copy.compute_root();
  turned.compute_root();
  EXPECT_EQ(read_by(plain, turned.name()), Names{copy.name()});
  expect_right();
}

// A consumer that reads the image through its own Func does so in the copy, too.
TEST_F(CopiedInput, ReadsTheFuncOfTheImage) {
  Func all = image.in();
  all.compute_root();
  Func copy = turned.copy_input(image);
  copy.compute_root();
  turned.compute_root();
  EXPECT_EQ(read_by(plain, turned.name()), Names{copy.name()});
  EXPECT_EQ(read_by(plain, copy.name()).size(), 1u);
  expect_right();
}

TEST_F(CopiedInput, RefusesWhatIsNotRead) {
  expect_error({"copied for a Func that reads it", "turned"},
               [&] { turned.copy_input(Buffer<int>(3)); });
  expect_error({"copied for a Func that reads it"}, [&] { Func("undefined").copy_input(image); });
}

TEST_F(Wrappers, RefusesSharingInPart) {
  f.in({g, h});
  expect_error({"share", "\"" /* names */, "together"}, [&] { f.in(g); });
  Func k("k");
  k(x, y) = f(x, y);
  expect_error({"Funcs that share a wrapper"}, [&] { f.in({k, g}); });
}

TEST_F(Wrappers, RefusesUpdatesOfWhatIsWrapped) {
  Func p("p"), q("q");
  p(x) = x;
  q(x) = p(x);
  Func w = p.in(q);
  expect_error({"complete"}, [&] { w(x) = 3; });
  Func undefined("undefined");
  expect_error({"needs a definition"}, [&] { undefined.in(g); });
  expect_error({"wrapped in itself"}, [&] { f.in(f); });
  expect_error({"at least one user"}, [&] { f.in(std::vector<Func>{}); });
}

TEST_F(Wrappers, RefusesAWrapperWhereACloneIs) {
  f.clone_in(g);
  expect_error({"either a wrapper or a clone"}, [&] { f.in(g); });
}

}  // namespace
}  // namespace retrograde
