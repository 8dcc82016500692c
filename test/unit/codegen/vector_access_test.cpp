// Vectorized reads at divided coordinates give the values of scalar reads, and access nothing else.
// Covers every phase of the division, negative ends, all tail strategies, and inputs that begin or
// end at a protected page. Oracle: floor division in plain C++. Unscheduled loops are vectorized
// where that is known to be right.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include "ir/visit.h"
#include "support/guarded_array.h"

namespace retrograde {
namespace {

using testing_codegen::Array;

int floor_div(int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }
int floor_mod(int a, int b) { return a - floor_div(a, b) * b; }

// in((s x + o) / c) + 1000 ((s x + o) % c), for an input whose values are its coordinates.
struct DividedAccess {
  int stride, divisor;
  int at(int x, int offset) const { return floor_div(stride * x + offset, divisor); }
  int value(int x, int offset) const {
    return at(x, offset) + 1000 * floor_mod(stride * x + offset, divisor);
  }
};

class DividedProgram {
 public:
  DividedProgram(const DividedAccess& access, int lanes, TailStrategy tail) : access_(access) {
    const Expr q = access.stride * x_ + offset_;
    f_(x_) = in_(q / access.divisor) + 1000 * (q % access.divisor);
    if (lanes > 1) f_.vectorize(x_, lanes, tail);
  }

  void expect_right(int min, int extent, int offset, Array::Guard guard) {
    const int low = access_.at(min, offset), high = access_.at(min + extent - 1, offset);
    Array memory(Int(32), static_cast<size_t>(high - low + 1), guard);
    for (int i = low; i <= high; i++) memory.data<int32_t>()[i - low] = i;
    Buffer<int32_t> input(memory.data<int32_t>(), high - low + 1), output(extent);
    input.set_min(low);
    output.set_min(min);
    in_.set(input);
    offset_.set(offset);
    f_.realize(output);
    for (int x = min; x < min + extent; x++)
      ASSERT_EQ(output(x), access_.value(x, offset))
          << "(" << access_.stride << " * " << x << " + " << offset << ") / " << access_.divisor
          << ", from " << min << ", extent " << extent;
  }

 private:
  DividedAccess access_;
  ImageParam in_{Int(32), 1, "in"};
  Param<int> offset_{"offset"};
  Var x_{"x"};
  Func f_{"f"};
};

bool fits(TailStrategy tail, int extent, int lanes) {
  if (tail == TailStrategy::RoundUp) return extent % lanes == 0;
  return tail != TailStrategy::ShiftInwards || extent >= lanes;
}

TEST(VectorAccess, DividedCoordinates) {
  const TailStrategy tails[] = {TailStrategy::ShiftInwards, TailStrategy::GuardWithIf,
                                TailStrategy::Predicate, TailStrategy::RoundUp};
  int turn = 0;
  for (const DividedAccess access :
       {DividedAccess{1, 2}, {2, 2}, {1, 3}, {3, 2}, {4, 2}, {6, 3}, {2, 4}, {1, 16}}) {
    for (const TailStrategy tail : tails) {
      const int lanes = turn++ % 2 ? 8 : 16;
      DividedProgram program(access, lanes, tail);
      for (int min = -4; min <= 3; min++) {
        for (const int extent : {1, 7, 8, 16, 19, 33, 48}) {
          if (!fits(tail, extent, lanes)) continue;
          const Array::Guard guard = (min + extent) % 2 ? Array::Guard::Above : Array::Guard::Below;
          program.expect_right(min, extent, min % 3, guard);
          if (HasFatalFailure()) return;
        }
      }
    }
  }
}

// The same without a schedule: the compiler vectorizes, with a scalar loop for the tail.
TEST(VectorAccess, DividedCoordinatesUnscheduled) {
  for (const DividedAccess access :
       {DividedAccess{1, 1}, {1, 2}, {2, 1}, {2, 2}, {1, 3}, {3, 2}, {4, 1}, {2, 4}, {1, 16}}) {
    DividedProgram program(access, 1, TailStrategy::Auto);
    for (int min = -4; min <= 3; min++) {
      for (const int extent : {1, 7, 8, 16, 19, 33, 48}) {
        const Array::Guard guard = (min + extent) % 2 ? Array::Guard::Above : Array::Guard::Below;
        program.expect_right(min, extent, min % 3, guard);
        if (HasFatalFailure()) return;
      }
    }
  }
}

bool has_vectors(Func f, const Target& target) {
  const Module module = f.compile_to_module(f.infer_arguments(), "f", target);
  return ir::any_node(module.get_function_by_name("f").lowered.body,
                      [](const ir::Ramp&) { return true; });
}

TEST(VectorAccess, OnlyPureVariablesGetLanesUnasked) {
  const Target target("x86-64-linux-sse41-avx-avx2");
  ImageParam in(Float(32), 2, "in");
  Var x("x"), y("y"), xi("xi");
  RDom r(0, 64);
  Func pure("pure"), column("column"), scan("scan"), transposed("transposed"),
      looked_up("looked_up");
  pure(x, y) = sqrt(in(x, y));
  EXPECT_TRUE(has_vectors(pure, target));
  EXPECT_FALSE(has_vectors(pure, target.with_feature(Target::DisableLLVMLoopOpt)));
  column(x, y) = undef<float>();
  column(x, r) = column(x, r - 1) + in(x, r);
  column.update().reorder(x, r);
  EXPECT_TRUE(has_vectors(column, target));
  scan(x, y) = undef<float>();
  scan(r, y) = scan(r - 1, y) + in(r, y);
  EXPECT_FALSE(has_vectors(scan, target));
  transposed(x, y) = in(x, y);
  transposed.reorder(y, x);
  EXPECT_FALSE(has_vectors(transposed, target));
  looked_up(x, y) = in(clamp(cast<int>(in(x, y)), 0, 9), y);
  EXPECT_FALSE(has_vectors(looked_up, target));
}

// Both phases of an upsampled signal interleaved, as inverse wavelet transforms have them.
TEST(VectorAccess, BothPhasesUnrolled) {
  ImageParam in(Int(32), 1, "in");
  Var x("x"), xi("xi");
  Func f("f");
  f(x) = select(x % 2 == 0, in(x / 2 - 1) + 10 * in(x / 2), 20 * in(x / 2 - 1) + in(x / 2));
  f.align_bounds(x, 2).split(x, x, xi, 2).reorder(xi, x).unroll(xi).vectorize(x, 8);
  for (const int min : {-6, -2, 0, 4}) {
    for (const int extent : {16, 18, 40}) {
      const int low = floor_div(min, 2) - 1, count = extent / 2 + 1;
      Array memory(Int(32), static_cast<size_t>(count));
      for (int i = 0; i < count; i++) memory.data<int32_t>()[i] = low + i;
      Buffer<int32_t> input(memory.data<int32_t>(), count), output(extent);
      input.set_min(low);
      output.set_min(min);
      in.set(input);
      f.realize(output);
      for (int i = min; i < min + extent; i++) {
        const int p = floor_div(i, 2), even = p - 1 + 10 * p, odd = 20 * (p - 1) + p;
        ASSERT_EQ(output(i), floor_mod(i, 2) == 0 ? even : odd) << i << " from " << min;
      }
    }
  }
}

}  // namespace
}  // namespace retrograde
