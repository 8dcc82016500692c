// The placement and scope of barriers between the steps of a block, for kernels as text. The order
// of a body is shown as the names that its steps store, with | for a block barrier, ~ for a warp
// barrier, [ ] around a loop and ( ) around a branch.
#include <gtest/gtest.h>

#include "diagnostics/error.h"
#include "ir/parse.h"
#include "ir/visit.h"
#include "lower/device/kernel.h"

namespace retrograde::lower {
namespace {

void show(const Stmt& s, std::string& text) {
  const auto* loop = s.as<For>();
  const bool is_loop = loop && !is_gpu_thread(loop->runs),
             is_branch = s.as<IfThenElse>() != nullptr;
  if (is_loop) text += "[ ";
  if (is_branch) text += "( ";
  if (const auto* store = s.as<Store>()) text += store->name + " ";
  if (const auto* call = s.as<Evaluate>()) {
    if (as_op(call->value, Op::gpu_barrier)) text += "| ";
    if (as_op(call->value, Op::gpu_warp_barrier)) text += "~ ";
  }
  for_each_child(
      s, [](const Expr&) {}, [&](const Stmt& part) { show(part, text); });
  if (is_loop) text += "] ";
  if (is_branch) text += ") ";
}

std::string order_of(const std::string& body, const std::vector<int>& threads = {64, 1, 1}) {
  Kernel kernel;
  kernel.name = "k";
  kernel.blocks = {1, 1, 1};
  kernel.threads = threads;
  kernel.body = parse_stmt(body);
  insert_barriers(kernel);
  std::string text;
  show(kernel.body, text);
  if (!text.empty()) text.pop_back();
  return text;
}

// ---- steps ----

TEST(InsertBarriers, StandBetweenAStoreAndAnotherThreadsLoad) {
  EXPECT_EQ(order_of(R"(
    gpu_thread for (x, 0, 64) { a[x] = 1f }
    gpu_thread for (x, 0, 64) { b[x] = a[63 - x]:float32 }
    gpu_thread for (x, 0, 64) { c[x] = a[62 - x]:float32 })"),
            "a | b c");
}

TEST(InsertBarriers, StandNowhereAroundAThreadsOwnElements) {
  EXPECT_EQ(order_of(R"(
    gpu_thread for (x, 0, 64) { a[x * 2 + 1] = 1f }
    gpu_thread for (x, 0, 64) { b[x] = a[x * 2 + 1]:float32 + a[x * 2]:float32 })"),
            "a b");
}

TEST(InsertBarriers, StandWhereAThreadReadsBeyondItsOwnElements) {
  const auto with_offset = [](int offset) {
    return order_of(text(R"(
      gpu_thread for (x, 0, 64) {
        for (u, 0, 4) { a[5 * x + u] = 1f }
      }
      gpu_thread for (x, 0, 64) {
        for (u, 0, 4) { b[4 * x + u] = a[(5 * x + u) + )",
                         offset, R"(]:float32 }
      })"));
  };
  EXPECT_EQ(with_offset(1), "[ a ] [ b ]");
  EXPECT_EQ(with_offset(2), "[ a ] | [ b ]") << "the next thread's first one";
}

TEST(InsertBarriers, StandNowhereBetweenElementsApart) {
  EXPECT_EQ(order_of(R"(
    gpu_thread for (x, 0, 64) { a[x] = 1f }
    gpu_thread for (x, 0, 64) { a[191 - x] = 2f }
    gpu_thread for (x, 0, 64) { b[x] = a[95 - x]:float32 })"),
            "a a | b");
}

TEST(InsertBarriers, StandBetweenArraysThatShareBytes) {
  const auto with_second_at = [](int offset) {
    return order_of(text(R"(
      allocate a[64_i64]:float32 gpu_shared at 0 {
        gpu_thread for (x, 0, 64) { a[x] = 1f }
      }
      allocate b[64_i64]:float32 gpu_shared at )",
                         offset, R"( {
        gpu_thread for (x, 0, 64) { b[x] = 1f }
      })"));
  };
  EXPECT_EQ(with_second_at(128), "a | b");
  EXPECT_EQ(with_second_at(256), "a b");
}

TEST(InsertBarriers, StandBeforeAConditionThatReads) {
  EXPECT_EQ(order_of(R"(
    gpu_thread for (x, 0, 64) { a[x] = 1f }
    if (a[0]:float32 < 2f) {
      gpu_thread for (x, 0, 64) { b[x] = 1f }
    }
    gpu_thread for (x, 0, 64) { c[x] = b[63 - x]:float32 })"),
            "a | ( b ) | c");
}

// ---- warps ----

TEST(InsertBarriers, AreOfWarpsWhereABlockIsOne) {
  EXPECT_EQ(order_of(R"(
    gpu_thread for (x, 0, 32) { a[x] = 1f }
    gpu_thread for (x, 0, 32) { b[x] = a[31 - x]:float32 })",
                     {32, 1, 1}),
            "a ~ b");
}

constexpr const char* rows = R"(
  gpu_thread for (y, 0, 4) { gpu_thread for (x, 0, 32) { a[32 * y + x] = 1f } }
  gpu_thread for (y, 0, 4) { gpu_thread for (x, 0, 32) { b[32 * y + x] = a[(32 * y - x) + 31]:float32 } })";

TEST(InsertBarriers, AreOfWarpsWhereEachElementIsOneWarps) {
  EXPECT_EQ(order_of(rows, {32, 4, 1}), "a ~ b");
  // Rows of 31 threads begin in the middle of warps.
  EXPECT_EQ(order_of(rows, {31, 4, 1}), "a | b");
  EXPECT_EQ(order_of(R"(
    gpu_thread for (y, 0, 4) { gpu_thread for (x, 0, 32) { a[32 * y + x] = 1f } }
    gpu_thread for (y, 0, 4) { gpu_thread for (x, 0, 32) { b[32 * y + x] = a[(96 - 32 * y) + x]:float32 } })",
                     {32, 4, 1}),
            "a | b")
      << "another warp's row is read";
}

TEST(InsertBarriers, OfWarpsOrderNothingBetweenWarps) {
  EXPECT_EQ(order_of(R"(
    gpu_thread for (y, 0, 4) {
      gpu_thread for (x, 0, 32) {
        a[32 * y + x] = 1f
        c[32 * y + x] = 1f
      }
    }
    gpu_thread for (y, 0, 4) { gpu_thread for (x, 0, 32) { b[32 * y + x] = a[(32 * y - x) + 31]:float32 } }
    gpu_thread for (y, 0, 4) { gpu_thread for (x, 0, 32) { d[32 * y + x] = c[127 - (32 * y + x)]:float32 } })",
                     {32, 4, 1}),
            "a c ~ b | d");
}

// ---- loops ----

TEST(InsertBarriers, StandBetweenIterationsThatUseTheSameElements) {
  EXPECT_EQ(order_of(R"(
    for (r, 0, 8) {
      gpu_thread for (x, 0, 64) { a[x] = in[x + 64 * r]:float32 }
      gpu_thread for (x, 0, 64) { b[x + 64 * r] = a[63 - x]:float32 }
    })"),
            "[ | a | b ]");
}

TEST(InsertBarriers, StandNotBetweenIterationsOfElementsOfTheirOwn) {
  EXPECT_EQ(order_of(R"(
    for (r, 0, 8) {
      gpu_thread for (x, 0, 64) { a[x + 64 * r] = in[x + 64 * r]:float32 }
      gpu_thread for (x, 0, 64) { b[x + 64 * r] = a[(64 * r - x) + 63]:float32 }
    })"),
            "[ a | b ]");
}

TEST(InsertBarriers, StandNotBetweenIterationsThatTakeTurnsInTwoHalves) {
  constexpr const char* body = R"(
    for (r, 0, 8) {
      gpu_thread for (x, 0, 64) { a[x + 64 * (r % 2)] = in[x + 64 * r]:float32 }
      gpu_thread for (x, 0, 64) { b[x + 64 * r] = a[(64 * (r % 2) - x) + 63]:float32 }
    })";
  EXPECT_EQ(order_of(body), "[ a | b ]");
}

TEST(InsertBarriers, StandWhereAnIterationReadsWhatTheOneBeforeStored) {
  EXPECT_EQ(order_of(R"(
    for (r, 1, 7) {
      gpu_thread for (x, 0, 64) { a[x + 64 * r] = a[(64 * r - x) - 1]:float32 }
    })"),
            "[ | a ]");
  EXPECT_EQ(order_of(R"(
    for (r, 2, 6) {
      gpu_thread for (x, 0, 64) { a[x + 64 * r] = a[(64 * r - x) - 65]:float32 }
    })"),
            "[ | a ]")
      << "two iterations before, with no barrier in between";
}

// An iteration conflicts with the end of the previous one, which moves the barrier between b and c
// to before b. After it, c and b remain for the next iteration, where b conflicts with a.
TEST(InsertBarriers, StandForWhatOtherBarriersLeaveBehind) {
  EXPECT_EQ(order_of(R"(
    for (r, 0, n) {
      gpu_thread for (x, 0, 64) { a[x + 64 * r] = b[(64 * r - x) + 63]:float32 }
      gpu_thread for (x, 0, 64) { b[(x + 64 * r) + 64] = d[(64 * r - x) + 63]:float32 }
      gpu_thread for (x, 0, 64) { c[x + 64 * r] = a[(64 * r - x) + 63]:float32 }
      gpu_thread for (x, 0, 64) { d[(x + 64 * r) + 64] = 1f }
    })"),
            "[ | a b | c d ]");
}

TEST(InsertBarriers, OfALoopThatMayNotRunOrderNothingBehindIt) {
  const auto with_loop = [](const char* extent) {
    return order_of(text(R"(
      gpu_thread for (x, 0, 64) { a[x] = 1f }
      for (r, 0, )",
                         extent, R"() {
        gpu_thread for (x, 0, 64) { b[x] = a[63 - x]:float32 }
        gpu_thread for (x, 0, 64) { d[x] = b[63 - x]:float32 }
      }
      gpu_thread for (x, 0, 64) { c[x] = a[62 - x]:float32 })"));
  };
  EXPECT_EQ(with_loop("4"), "a [ | b | d ] c");
  EXPECT_EQ(with_loop("n"), "a [ | b | d ] | c");
}

TEST(InsertBarriers, OfOneBranchOrderNothingBehindBoth) {
  EXPECT_EQ(order_of(R"(
    gpu_thread for (x, 0, 64) { a[x] = 1f }
    if (n < 3) {
      gpu_thread for (x, 0, 64) { b[x] = a[63 - x]:float32 }
    }
    gpu_thread for (x, 0, 64) { c[x] = a[62 - x]:float32 })"),
            "a ( | b ) | c");
}

}  // namespace
}  // namespace retrograde::lower
