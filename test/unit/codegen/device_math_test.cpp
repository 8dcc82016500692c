// The mathematical functions of kernels on the simulated device, which has the same bits as any
// other device. Their errors against the C library in long double must not exceed those stated by
// codegen/math/math_table.h and docs/gpu.md, over floats of all sizes and in typical ranges.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <sstream>

#include "codegen/math/math_table.h"
#include "ir/build.h"
#include "ir/operators.h"
#include "simt/simt_driver.h"
#include "support/page_table.h"
#include "support/reference_functions.h"

namespace retrograde {

namespace codegen {
void PrintTo(const MathFunction& function, std::ostream* out) { *out << function.stem; }
}  // namespace codegen

namespace {

// Must be set before the first use of a device.
[[maybe_unused]] const int simulated = setenv("RETROGRADE_GPU", "simulated", 1);

using ir::Op;

#ifdef RETROGRADE_MANY_PROGRAMS
constexpr int samples = 1 << 20;
#else
constexpr int samples = 1 << 14;
#endif

// ---- operands ----

// Any number, with all exponents equally likely.
template <typename T>
T of_any_size(std::mt19937_64& engine) {
  using Bits = std::conditional_t<sizeof(T) == 4, uint32_t, uint64_t>;
  while (true) {
    const T x = std::bit_cast<T>(static_cast<Bits>(engine()));
    if (std::isfinite(x)) return x;
  }
}

// One third arbitrary, one third up to 10, one third near the points where functions turn or end.
template <typename T>
T operand(std::mt19937_64& engine, int i) {
  const auto between = [&](double low, double high) {
    return static_cast<T>(std::uniform_real_distribution<double>(low, high)(engine));
  };
  constexpr double ends = sizeof(T) == 4 ? 104 : 746;  // of exp
  constexpr double places[] = {0, 0.5, 1, -1, 1.5707963267948966, 3.141592653589793, 2};
  switch (i % 6) {
    case 0:
    case 1:
      return of_any_size<T>(engine);
    case 2:
    case 3:
      return between(-10, 10);
    case 4:
      return between(-ends, ends);
    default:
      return static_cast<T>(places[engine() % std::size(places)]) + between(-0.01, 0.01);
  }
}

// ---- errors ----

struct Worst {
  double ulp = 0;
  std::string where;
};

template <typename T>
Worst worst_error(Op op) {
  const bool is_binary = ir::op_info(op).arity == 2;
  std::mt19937_64 engine(17);
  Buffer<T> x(samples), y(samples);
  for (int i = 0; i < samples; ++i) {
    x(i) = operand<T>(engine, i);
    y(i) = operand<T>(engine, i / 6);
  }
  Var i("i"), thread("thread");
  Func values("values");
  std::vector<Expr> operands{x(i)};
  if (is_binary) operands.push_back(y(i));
  values(i) = ir::call_op(op, operands);
  values.gpu_tile(i, thread, 256);
  const Buffer<T> got = values.realize(
      {samples},
      get_host_target().with_feature(Target::CUDA).with_feature(Target::CUDACapability80));
  Worst worst;
  for (int k = 0; k < samples; ++k) {
    const double ulp = error_in_ulp(got(k), reference_value(op, x(k), y(k)));
    if (!(ulp > worst.ulp)) continue;
    std::ostringstream where;
    where << ir::op_info(op).name << "(" << std::hexfloat << x(k);
    if (is_binary) where << ", " << y(k);
    where << ") = " << got(k);
    worst = {ulp, where.str()};
  }
  return worst;
}

class DeviceMath : public testing::TestWithParam<codegen::MathFunction> {
 protected:
  void SetUp() override {
    retrograde_simt_options options;
    retrograde_simt_get_options(&options);
    options.find_races = 0;  // the threads share nothing
    retrograde_simt_set_options(&options);
  }
  template <typename T>
  void expect_at_most(double stated) {
    const Worst worst = worst_error<T>(GetParam().op);
    std::printf("%-6s %-8s %.3f ULP, stated %.2f\n", ir::op_info(GetParam().op).name,
                to_string(type_of<T>()).c_str(), worst.ulp, stated);
    EXPECT_LE(worst.ulp, stated) << worst.where;
#ifdef RETROGRADE_MANY_PROGRAMS
    EXPECT_LE(stated, 1.3 * worst.ulp + 0.1) << "more is stated than need be";
#endif
  }
};

TEST_P(DeviceMath, ErrorsAreAtMostThoseStated) {
  expect_at_most<float>(GetParam().device_float32_ulp);
  expect_at_most<double>(GetParam().device_float64_ulp);
}

INSTANTIATE_TEST_SUITE_P(Functions, DeviceMath, testing::ValuesIn(codegen::math_functions),
                         [](const auto& f) { return std::string(f.param.stem); });

// Random programs on the simulated device are compared with the bounds for any correct
// implementation.
TEST(DeviceMathTable, ErrorsAreThoseOfACorrectImplementation) {
  for (const codegen::MathFunction& f : codegen::math_functions) {
    const int allowed = ir::op_info(f.op).real.error.ulp_elsewhere;
    EXPECT_LE(std::max(f.device_float32_ulp, f.device_float64_ulp), allowed) << f.stem;
  }
}

TEST(DeviceMathPage, HoldsTheErrorsOfTheTable) {
  std::ostringstream table;
  table << "| function | float32 | float64 |\n|---|---|---|\n";
  for (const codegen::MathFunction& f : codegen::math_functions) {
    table << "| `" << ir::op_info(f.op).name << "` | " << f.device_float32_ulp << " | "
          << f.device_float64_ulp << " |\n";
  }
  expect_table_in_page(RETROGRADE_TEST_DIR "/../docs/gpu.md", "device_math", table.str());
}

}  // namespace
}  // namespace retrograde
