// Every golden/graph/<pass>/<case>.in, the text of a graph, through its pass must give <case>.out.
// RETROGRADE_UPDATE_GOLDEN=1 writes the .out files instead; read the difference before you commit
// it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>

#include "autodiff/graph_passes.h"
#include "graph/graph.h"

namespace retrograde::ir {
namespace {

namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<fs::path> find_cases() {
  std::vector<fs::path> cases;
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(RETROGRADE_TEST_DIR) / "golden/graph")) {
    if (entry.path().extension() == ".in") cases.push_back(entry.path());
  }
  std::sort(cases.begin(), cases.end());
  return cases;
}

// Fresh loops are numbered in the process: here in the order in which they appear.
std::string renumbered(const std::string& text) {
  static const std::regex fresh("v\\$[0-9]+");
  std::map<std::string, std::string> numbers;
  std::string result;
  auto at = text.begin();
  for (std::sregex_iterator it(text.begin(), text.end(), fresh), end; it != end; ++it) {
    result.append(at, text.begin() + it->position());
    const auto number = numbers.emplace(it->str(), "v$" + std::to_string(numbers.size())).first;
    result += number->second;
    at = text.begin() + it->position() + it->length();
  }
  return result.append(at, text.end());
}

class GraphGolden : public ::testing::TestWithParam<fs::path> {};

TEST_P(GraphGolden, GivesWhatItsFileSays) {
  const GraphPass* pass = find_graph_pass(GetParam().parent_path().filename().string());
  ASSERT_NE(pass, nullptr);
  const Graph before = parse_graph(read_file(GetParam()));
  validate(before, "parse_graph");
  const std::string text = to_text(before);
  const Graph after = graph_of(pass->run(before.outputs));
  validate(after, pass->name);
  EXPECT_EQ(to_text(before), text) << "the pass changed its input";
  EXPECT_EQ(difference(parse_graph(to_text(after)), after), "");

  fs::path expected = GetParam();
  expected.replace_extension(".out");
  const std::string result = renumbered(to_text(after));
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(expected) << result;
  EXPECT_EQ(result, read_file(expected));
}

INSTANTIATE_TEST_SUITE_P(Cases, GraphGolden, ::testing::ValuesIn(find_cases()),
                         [](const auto& info) {
                           return info.param.parent_path().filename().string() + "_" +
                                  info.param.stem().string();
                         });

// Each pass has a case.
TEST(GraphPasses, AreAllTested) {
  for (const GraphPass& pass : graph_passes())
    EXPECT_TRUE(fs::exists(fs::path(RETROGRADE_TEST_DIR) / "golden/graph" / pass.name))
        << pass.name;
}

}  // namespace
}  // namespace retrograde::ir
