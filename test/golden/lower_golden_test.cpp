// Every golden/lower/<pass>/<case>.in through its pass must give <case>.out.
// RETROGRADE_UPDATE_GOLDEN=1 writes the .out files instead; read the difference before you commit
// it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "ir/validate.h"
#include "lower/statement_passes.h"
#include "support/golden_files.h"

namespace retrograde::lower {
namespace {

namespace fs = std::filesystem;

struct GoldenCase {
  std::string pass;
  fs::path input;
};
void PrintTo(const GoldenCase& c, std::ostream* out) { *out << c.input; }

std::vector<GoldenCase> find_cases() {
  std::vector<GoldenCase> cases;
  for (const fs::path& input : files_below(fs::path(RETROGRADE_TEST_DIR) / "golden/lower", ".in"))
    cases.push_back({input.parent_path().filename().string(), input});
  return cases;
}

// The expected output of a pass that must reject its input is the message.
std::string outcome(const StatementPass& pass, const std::string& source) {
  try {
    return print(pass.run(parse_stmt(source)));
  } catch (const UserError& e) {
    return text("error: ", e.what(), "\n");
  }
}

class LowerGolden : public testing::TestWithParam<GoldenCase> {};

TEST_P(LowerGolden, GivesTheExpectedProgram) {
  const StatementPass* pass = find_statement_pass(GetParam().pass);
  ASSERT_NE(pass, nullptr) << GetParam().pass;
  std::string result = outcome(*pass, read_file(GetParam().input));
  fs::path expected = fs::path(GetParam().input).replace_extension(".out");
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) {
    std::ofstream(expected) << result;
    return;
  }
  ASSERT_TRUE(fs::exists(expected)) << expected << " is missing; see the head of this test";
  EXPECT_EQ(result, read_file(expected));
}

TEST_P(LowerGolden, TwiceGivesTheSameText) {
  const StatementPass* pass = find_statement_pass(GetParam().pass);
  ASSERT_NE(pass, nullptr);
  std::string source = read_file(GetParam().input);
  EXPECT_EQ(outcome(*pass, source), outcome(*pass, source));
}

INSTANTIATE_TEST_SUITE_P(Cases, LowerGolden, testing::ValuesIn(find_cases()), [](const auto& info) {
  std::string name = info.param.pass + "_" + info.param.input.stem().string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
});

// Parsed inputs print as they were written, so golden inputs also test the printer.
TEST_P(LowerGolden, InputRoundTrips) {
  Stmt program = parse_stmt(read_file(GetParam().input));
  EXPECT_TRUE(equal(program, parse_stmt(print(program))));
}

// Copying all arms into each copy would take half a minute.
TEST(UnrollLoops, CopiesOfAChoiceFromManyArmsTakeAStepEach) {
  constexpr int n = 4000;
  const Expr c = variable("c");
  Expr choice = Expr(-1);
  for (int i = n; i-- > 0;)
    choice = make_select(binary(Kind::EQ, c, Expr(i)), variable("x") * Expr(i + 2), choice);
  const Stmt loop = make_for("c", Expr(0), Expr(n), ForType::Unrolled, make_store("f", choice, c));
  const std::clock_t begin = std::clock();
  Stmt copies;
  run_on_large_stack([&] { copies = unroll_loops(loop); });
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 3);
  const auto* block = copies.as<Block>();
  ASSERT_TRUE(block && block->stmts.size() == n);
  EXPECT_TRUE(equal(block->stmts[7], make_store("f", variable("x") * Expr(9), Expr(7))));
}

}  // namespace
}  // namespace retrograde::lower
