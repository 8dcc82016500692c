// Loads and stores with every form of index, compared with plain loops. Buffers begin or end
// exactly at the lowest or highest access, next to a protected page.
#include "unit/codegen/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

const Type element_types[] = {Bool(), Int(16), Float(32), Float(64)};

// The value of lane i of an index, for a base of 0 in variable "b".
using LaneIndex = std::function<int64_t(int)>;

struct Shape {
  std::string name;
  Expr index;
  LaneIndex at;
};

std::vector<Shape> shapes(int lanes, Expr base) {
  std::vector<Shape> result;
  const auto ramp = [&](int stride) { return make_ramp(base, make_const(Int(32), stride), lanes); };
  for (int stride : {1, -1, 2, 3, 4, -2, -3, 7, -9, 100}) {
    result.push_back(
        {text("stride ", stride), ramp(stride), [stride](int i) { return int64_t{stride} * i; }});
  }
  result.push_back({"broadcast", make_broadcast(base, lanes), [](int) { return 0; }});
  result.push_back({"sum of ramps", binary(Kind::Add, ramp(1), make_ramp(0, 1, lanes)),
                    [](int i) { return 2 * i; }});
  result.push_back({"scaled ramp",
                    binary(Kind::Mul, make_ramp(base, 1, lanes), make_broadcast(3, lanes)),
                    [](int i) { return 3 * i; }});
  result.push_back({"arbitrary",
                    binary(Kind::Mod, binary(Kind::Mul, ramp(1), make_broadcast(5, lanes)),
                           make_broadcast(7, lanes)),
                    [](int i) { return (5 * i) % 7; }});
  result.push_back({"unsigned",
                    cast_to(UInt(32, lanes),
                            binary(Kind::Mod, binary(Kind::Mul, ramp(1), make_broadcast(3, lanes)),
                                   make_broadcast(11, lanes))),
                    [](int i) { return (3 * i) % 11; }});
  // Clamped to an image as at its borders: from the third lane on, up to it, and between the two.
  const auto held = [&](int low, int high) {
    const auto bound = [&](int to) { return make_broadcast(base + to, lanes); };
    const Expr inside = binary(Kind::Max, binary(Kind::Min, ramp(1), bound(high)), bound(low));
    const Expr row = make_broadcast(base * 3, lanes);
    result.push_back({text("held in ", low, " to ", high),
                      binary(Kind::Sub, binary(Kind::Add, inside, row), row),
                      [=](int i) { return std::max(std::min(i, high), low); }});
  };
  held(2, lanes);
  held(-1, 2);
  held(1, lanes - 2);
  held(lanes, lanes + 1);
  held(-1, lanes);
  if (lanes % 2 == 0) {
    const int half = lanes / 2;
    const auto nested = [&](int inner, int outer) {
      return make_ramp(make_ramp(base, inner, half), make_broadcast(outer, half), 2);
    };
    result.push_back({"rows", nested(1, 50), [half](int i) { return i % half + 50 * (i / half); }});
    result.push_back({"dense rows", nested(1, half), [](int i) { return i; }});
    result.push_back({"strided rows", nested(3, 70),
                      [half](int i) { return 3 * (i % half) + 70 * (i / half); }});
  }
  return result;
}

struct Span {
  int64_t low, high;
};
bool is_on(int lane) { return lane % 3 != 1; }

// The range of the enabled lanes.
Span span_of(const Shape& shape, int lanes, bool masked) {
  Span span{shape.at(0), shape.at(0)};
  for (int i = 0; i < lanes; i++) {
    if (masked && !is_on(i)) continue;
    span.low = std::min(span.low, shape.at(i));
    span.high = std::max(span.high, shape.at(i));
  }
  return span;
}

Scalar nth_value(Type type, int64_t n) {
  return type.is_bool() ? Scalar::of_bool(n % 3 == 0)
                        : eval_cast(type, Scalar::of_int(Int(64), n % 120));
}

// A mask with enabled and disabled lanes, loaded from memory so that no pass can see its value.
Expr mask_of(int lanes) { return make_load(Bool(lanes), "mask", make_ramp(0, 1, lanes)); }

void fill_mask(Array& mask) {
  for (size_t i = 0; i < mask.size(); i++) mask.set(i, Scalar::of_bool(is_on(static_cast<int>(i))));
}

// A function of an input, a mask, an output and the base of the indices.
LoweredFunction masked_access(const std::string& name, Type type, const Stmt& body) {
  LoweredFunction f;
  f.name = name;
  f.args = {input("in", type), input("mask", Bool()), output("out", type),
            scalar_argument("b", Int(32))};
  f.body = body;
  return f;
}

void check_load(const Shape& shape, Type type, int lanes, bool masked, const Target& target,
                Array::Guard guard) {
  const Span span = span_of(shape, lanes, masked);
  const Expr load =
      make_load(type.with_lanes(lanes), "in", shape.index, masked ? mask_of(lanes) : Expr());
  const LoweredFunction f =
      masked_access("loads", type, make_store("out", load, make_ramp(0, 1, lanes)));
  Array in(type, static_cast<size_t>(span.high - span.low + 1), guard),
      mask(Bool(), static_cast<size_t>(lanes)), out(type, static_cast<size_t>(lanes));
  for (size_t i = 0; i < in.size(); i++) in.set(i, nth_value(type, static_cast<int64_t>(i)));
  fill_mask(mask);
  auto base = static_cast<int32_t>(-span.low);
  void* args[] = {in.raw(), mask.raw(), out.raw(), &base};
  ASSERT_EQ(compile_test(f, target)->call(nullptr, args), 0);
  for (int i = 0; i < lanes; i++) {
    if (masked && !is_on(i)) continue;
    ASSERT_TRUE(
        same(out.get(static_cast<size_t>(i)), in.get(static_cast<size_t>(shape.at(i) - span.low))))
        << "lane " << i << " of " << lanes << ", " << to_string(type) << ", " << shape.name
        << (masked ? ", masked" : "");
  }
}

void check_store(const Shape& shape, Type type, int lanes, bool masked, const Target& target,
                 Array::Guard guard) {
  const Span span = span_of(shape, lanes, masked);
  const Expr value = make_load(type.with_lanes(lanes), "in", make_ramp(0, 1, lanes));
  const LoweredFunction f = masked_access(
      "stores", type, make_store("out", value, shape.index, masked ? mask_of(lanes) : Expr()));
  const auto size = static_cast<size_t>(span.high - span.low + 1);
  Array in(type, static_cast<size_t>(lanes)), mask(Bool(), static_cast<size_t>(lanes)),
      out(type, size, guard);
  for (size_t i = 0; i < in.size(); i++) in.set(i, nth_value(type, static_cast<int64_t>(i + 7)));
  fill_mask(mask);
  std::vector<Scalar> expected;
  for (size_t i = 0; i < size; i++) expected.push_back(out.get(i));
  for (int i = 0; i < lanes; i++) {  // at equal indices the last lane wins
    if (!masked || is_on(i))
      expected[static_cast<size_t>(shape.at(i) - span.low)] = in.get(static_cast<size_t>(i));
  }
  auto base = static_cast<int32_t>(-span.low);
  void* args[] = {in.raw(), mask.raw(), out.raw(), &base};
  ASSERT_EQ(compile_test(f, target)->call(nullptr, args), 0);
  for (size_t i = 0; i < size; i++) {
    ASSERT_TRUE(same(out.get(i), expected[i]))
        << "element " << i << ", " << lanes << " lanes of " << to_string(type) << ", " << shape.name
        << (masked ? ", masked" : "");
  }
}

struct Setup {
  Target target;
  int lanes;
};

std::vector<Setup> setups() {
  std::vector<Setup> result;
  for (int lanes : {2, 3, 8, 20, 32}) result.push_back({test_target(), lanes});
  if (test_target().arch == Target::X86) result.push_back({Target("x86-64-linux"), 5});
  return result;
}

TEST(CodegenAccess, LoadsOfEveryShape) {
  for (const auto& [target, lanes] : setups()) {
    for (Type type : element_types) {
      for (const Shape& shape : shapes(lanes, variable("b"))) {
        check_load(shape, type, lanes, false, target, Array::Guard::Above);
        check_load(shape, type, lanes, false, target, Array::Guard::Below);
        if (lanes % 2 == 0 || type.bits() != 16)
          check_load(shape, type, lanes, true, target, Array::Guard::Above);
      }
    }
  }
}

TEST(CodegenAccess, StoresOfEveryShape) {
  for (const auto& [target, lanes] : setups()) {
    if (lanes == 2) continue;
    for (Type type : element_types) {
      for (const Shape& shape : shapes(lanes, variable("b"))) {
        check_store(shape, type, lanes, false, target, Array::Guard::Above);
        check_store(shape, type, lanes, false, target, Array::Guard::Below);
        if (type.bits() != 16) check_store(shape, type, lanes, true, target, Array::Guard::Above);
      }
    }
  }
}

TEST(CodegenAccess, ScalarPredicates) {
  LoweredFunction f;
  f.name = "scalar_predicates";
  f.args = {input("in", Int(32)), output("out", Int(32)), scalar_argument("n", Int(32))};
  const Expr i = variable("i"), inside = i < variable("n");
  const Expr load = make_load(Int(32), "in", i, inside);
  f.body = make_for("i", 0, 10, ForType::Serial, make_store("out", load + 1, i, inside));
  Array in(Int(32), 4), out(Int(32), 4);
  for (int k = 0; k < 4; k++) in.data<int32_t>()[k] = 10 * k;
  int32_t n = 4;
  void* args[] = {in.raw(), out.raw(), &n};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  for (int k = 0; k < 4; k++) EXPECT_EQ(out.data<int32_t>()[k], 10 * k + 1);
}

// A let hides that an index is dense; elements must still be read and written densely.
TEST(CodegenAccess, NamedRamps) {
  LoweredFunction f;
  f.name = "named_ramps";
  f.args = {input("in", Int(32)), output("out", Int(32)), scalar_argument("b", Int(32))};
  const int lanes = 8;
  const Expr t = variable("t", Int(32, lanes)), u = variable("u", Int(32, lanes));
  const Expr load = make_load(Int(32, lanes), "in", binary(Kind::Add, u, make_broadcast(1, lanes)));
  f.body = make_let("u", binary(Kind::Add, t, make_broadcast(variable("b"), lanes)),
                    make_store("out", load, t));
  f.body = make_let("t", make_ramp(variable("b"), 2, lanes), f.body);
  Array in(Int(32), 20), out(Int(32), 17);
  for (int k = 0; k < 20; k++) in.data<int32_t>()[k] = 10 * k;
  int32_t b = 2;
  void* args[] = {in.raw(), out.raw(), &b};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  for (int k = 0; k < lanes; k++) EXPECT_EQ(out.data<int32_t>()[2 + 2 * k], 10 * (5 + 2 * k));
}

// The intermediate sums pass 2^31; the index itself does not.
TEST(CodegenAccess, IndicesMayOverflowOnTheWay) {
  LoweredFunction f;
  f.name = "far";
  f.args = {input("in", Int(32)), output("out", Int(32)), scalar_argument("m", Int(32))};
  const Expr m = variable("m"), i = variable("i");
  const Expr index = binary(Kind::Sub, binary(Kind::Add, binary(Kind::Mul, m, Expr(1000)), i),
                            binary(Kind::Mul, m, Expr(1000)));
  f.body =
      make_for("i", 0, 8, ForType::Serial, make_store("out", make_load(Int(32), "in", index), i));
  Array in(Int(32), 8), out(Int(32), 8);
  for (int k = 0; k < 8; k++) in.data<int32_t>()[k] = k * k;
  int32_t m_value = 2000000000;
  void* args[] = {in.raw(), out.raw(), &m_value};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  for (int k = 0; k < 8; k++) EXPECT_EQ(out.data<int32_t>()[k], k * k);
}

TEST(CodegenAccess, ShuffleAndReduce) {
  LoweredFunction f;
  f.name = "shuffles";
  f.args = {input("in", Int(32)), output("out", Int(32))};
  const Expr a = make_load(Int(32, 4), "in", make_ramp(0, 1, 4)),
             b = make_load(Int(32, 4), "in", make_ramp(4, 1, 4));
  const Expr all = make_load(Int(32, 12), "in", make_ramp(0, 1, 12));
  const auto put = [](Expr value, int at) {
    return make_store("out", value, lanes_at(at, value.type().lanes()));
  };
  f.body = make_block({
      put(make_shuffle({a, b}, {0, 4, 1, 5, 2, 6, 3, 7}), 0),
      put(make_shuffle(
              {a, make_load(Int(32, 3), "in", make_ramp(8, 1, 3)), make_load(Int(32), "in", 11)},
              {7, 4, 0}),
          8),
      put(make_shuffle({b}, {2}), 11),
      put(make_vector_reduce(Kind::Add, all, 1), 12),
      put(make_vector_reduce(Kind::Max, all, 4), 13),
      put(make_vector_reduce(Kind::Mul, all, 6), 17),
      put(make_vector_reduce(Kind::Min, all, 3), 23),
  });
  Array in(Int(32), 12), out(Int(32), 26);
  for (int k = 0; k < 12; k++) in.data<int32_t>()[k] = k + 1;
  ASSERT_EQ(call(f, {&in, &out}), 0);
  const std::vector<int32_t> expected = {1, 5, 2, 6,  3, 7,  4,  8,  12, 9,   1, 7, 78,
                                         3, 6, 9, 12, 2, 12, 30, 56, 90, 132, 1, 5, 9};
  EXPECT_EQ(std::vector<int32_t>(out.data<int32_t>(), out.data<int32_t>() + 26), expected);
}

TEST(CodegenAccess, RampsAsValues) {
  LoweredFunction f;
  f.name = "ramps";
  f.args = {output("out", Float(32)), output("whole", Int(16))};
  f.body = make_block({make_store("out", make_ramp(Expr(1.5f), Expr(0.25f), 5), make_ramp(0, 1, 5)),
                       make_store("whole",
                                  make_ramp(make_ramp(Expr(int16_t{1}), Expr(int16_t{2}), 3),
                                            make_broadcast(Expr(int16_t{10}), 3), 2),
                                  make_ramp(0, 1, 6))});
  Array out(Float(32), 5), whole(Int(16), 6);
  ASSERT_EQ(call(f, {&out, &whole}), 0);
  EXPECT_EQ(std::vector<float>(out.data<float>(), out.data<float>() + 5),
            (std::vector<float>{1.5, 1.75, 2, 2.25, 2.5}));
  EXPECT_EQ(std::vector<int16_t>(whole.data<int16_t>(), whole.data<int16_t>() + 6),
            (std::vector<int16_t>{1, 3, 5, 11, 13, 15}));
}

}  // namespace
}  // namespace retrograde::testing_codegen
