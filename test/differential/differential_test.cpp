// Compares the same pipelines in Halide 14, in Retrograde's machine code and in its interpreter.
//
// Types must agree. Integers, and floats whose arithmetic happens to be exact, must agree bit for
// bit. Other floats must agree within twice the error bound that the interpreter derives for each
// element from the roundings that a compiler may move (testing/tracked_value.h).
#include <gtest/gtest.h>

#include <functional>
#include <regex>

#include "differential/side.h"

namespace differential {
namespace {

using retrograde::oracle::Array;
using retrograde::oracle::Comparison;

// How many elements may be left uncompared because a discrete choice depends on rounding.
constexpr double max_unstable_fraction = 0.05;

// When `who` throws, the others are still compared.
void expect_agreement(const std::vector<Array>& expected, const std::string& who,
                      const std::function<std::vector<HostBuffer>()>& run) {
  std::vector<HostBuffer> actual;
  ASSERT_NO_THROW(actual = run()) << who;
  ASSERT_EQ(expected.size(), actual.size()) << who;
  for (size_t i = 0; i < expected.size(); ++i) {
    const halide_buffer_t& buffer = *actual[i].raw_buffer();
    EXPECT_EQ(retrograde::to_string(expected[i].type),
              retrograde::to_string(retrograde::oracle::type_of_buffer(buffer)))
        << who << ", value " << i;
    if (expected[i].type != retrograde::oracle::type_of_buffer(buffer)) continue;
    const Comparison comparison = compare(expected[i], buffer);
    EXPECT_TRUE(comparison.agrees())
        << who << ", value " << i << " of type " << retrograde::to_string(expected[i].type) << ": "
        << comparison.mismatches << " differ, first " << comparison.first_mismatch;
    EXPECT_LE(comparison.unstable, max_unstable_fraction * expected[i].region.points())
        << who << ", value " << i << ": too much depends on rounding to be compared";
  }
}

// Removes differences in naming: numbers of fresh variables ("v3") depend on earlier ones in each
// library, and Halide writes a dot after a loop along which a Func slides.
std::string comparable(const std::string& nest) {
  const std::string numbered = std::regex_replace(nest, std::regex("\\bv[0-9]+"), "v#");
  return std::regex_replace(numbered, std::regex("\\.(:| in )"), "$1");
}

// These tests run first in each process. Names of Funcs created for another Func contain its name,
// and Halide prints none of them when it has a number, as happens when names of other cases use up
// the counter.
class LoopNests : public ::testing::TestWithParam<std::string> {};

TEST_P(LoopNests, AreShownAsHalideShowsThem) {
  testing::internal::CaptureStderr();
  print_nest_in_halide(GetParam());
  const std::string expected = testing::internal::GetCapturedStderr();
  testing::internal::CaptureStderr();
  print_nest_in_retrograde(GetParam());
  EXPECT_FALSE(expected.empty());
  EXPECT_EQ(comparable(testing::internal::GetCapturedStderr()), comparable(expected));
}

class Differential : public ::testing::TestWithParam<std::string> {};

TEST_P(Differential, HalideAndMachineCodeAgreeWithTheInterpreter) {
  const std::string& name = GetParam();
  const std::vector<Array> expected = interpret(name);
  for (const bool scheduled : {false, true}) {
    const std::string how = scheduled ? ", scheduled" : "";
    expect_agreement(expected, "Halide" + how, [&] { return run_in_halide(name, scheduled); });
    expect_agreement(expected, "Retrograde" + how,
                     [&] { return run_in_retrograde(name, scheduled); });
  }
}

INSTANTIATE_TEST_SUITE_P(Schedules, LoopNests, ::testing::ValuesIn(nest_names()),
                         [](const auto& info) { return info.param; });

INSTANTIATE_TEST_SUITE_P(Pipelines, Differential, ::testing::ValuesIn(case_names()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace differential
