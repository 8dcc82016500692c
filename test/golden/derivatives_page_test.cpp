// The tables of docs/derivatives.md are written here from the rule table itself, so that the page
// cannot state a convention that the code does not have. The prose around them lives in the page: a
// table stands between the lines "<!-- table: NAME -->" and "<!-- end of table -->".
// RETROGRADE_UPDATE_GOLDEN=1 writes the tables; read the difference before you commit it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>

#include "autodiff/rules/derivative_rules.h"
#include "ir/build.h"

namespace retrograde::autodiff {
namespace {

std::string cell(const std::string& text) {
  std::string result;
  for (char c : text) result += c == '|' ? std::string("\\|") : std::string(1, c);
  return result;
}

std::string row(const std::string& name, const DerivativeRule& rule) {
  std::ostringstream out;
  out << "| `" << name << "` | " << cell(rule.formula) << " | " << cell(rule.domain) << " | "
      << cell(rule.convention) << " | " << cell(rule.infinities) << " | ";
  if (rule.max_ulp < 0) {
    out << "not bounded";
  } else {
    out << rule.max_ulp;
  }
  out << " | " << cell(rule.source) << " |\n";
  return out.str();
}

struct Tables {
  std::string smooth, others;  // operators with partials, and those without
};

const char* const smooth_head =
    "| operator | partials | domain | at kinks and poles | at infinities | ULP | source |\n"
    "|---|---|---|---|---|---|---|\n";

Tables tables() {
  Tables result{smooth_head, "| operators | rule |\n|---|---|\n"};
  std::map<std::string, std::string> by_reason;  // operators without partials, together
  auto add = [&](const std::string& name, const DerivativeRule& rule) {
    if (rule.cls == RuleClass::Smooth) {
      result.smooth += row(name, rule);
    } else if (rule.cls != RuleClass::NoRule) {
      std::string& names = by_reason[rule.convention];
      names += (names.empty() ? "`" : ", `") + name + "`";
    }
  };
#define RETROGRADE_BINARY(K) add(#K, derivative_rule(Kind::K));
#include "ir/kinds.def"
  for (Kind k : {Kind::Select, Kind::Cast, Kind::Not}) add(kind_name(k), derivative_rule(k));
  for (int i = 0; i < op_count; ++i) {
    const Op op = static_cast<Op>(i);
    add(op_info(op).name, derivative_rule(op));
  }
  for (const auto& [reason, names] : by_reason)
    result.others += "| " + names + " | " + cell(reason) + " |\n";
  return result;
}

// Where in the page a table begins and ends; nothing when a marker is missing.
struct Span {
  size_t begin, end;
};
std::optional<Span> table_in(const std::string& page, const std::string& name) {
  const std::string opening = "<!-- table: " + name + " -->\n", closing = "<!-- end of table -->\n";
  const size_t at = page.find(opening);
  if (at == std::string::npos) return std::nullopt;
  const size_t begin = at + opening.size(), end = page.find(closing, begin);
  if (end == std::string::npos) return std::nullopt;
  return Span{begin, end};
}

class DerivativesPage : public testing::Test {
 protected:
  static std::string read() {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void holds(const std::string& name, const std::string& table) {
    std::string page = read();
    const auto span = table_in(page, name);
    ASSERT_TRUE(span) << path << " has no lines around a table " << name;
    const size_t length = span->end - span->begin;
    if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) {
      std::ofstream(path) << page.replace(span->begin, length, table);
      return;
    }
    EXPECT_EQ(page.substr(span->begin, length), table)
        << "RETROGRADE_UPDATE_GOLDEN=1 writes " << path;
  }
  static inline const std::string path = RETROGRADE_TEST_DIR "/../docs/derivatives.md";
};

TEST_F(DerivativesPage, holds_the_partials_of_the_rule_table) {
  holds("partials", tables().smooth);
}

TEST_F(DerivativesPage, holds_the_reasons_of_operators_without_partials) {
  holds("no_partials", tables().others);
}

}  // namespace
}  // namespace retrograde::autodiff
