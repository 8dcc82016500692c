// Generates the tables of docs/derivatives.md from the rule table, so that the page agrees with the
// code.
#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>

#include "autodiff/rules/derivative_rules.h"
#include "ir/build.h"
#include "support/page_table.h"

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
  Tables result{smooth_head, "| operators | derivative |\n|---|---|\n"};
  std::map<std::string, std::string> by_reason;  // operators without partials, together
  auto add = [&](const std::string& name, const DerivativeRule& rule) {
    if (rule.cls == RuleClass::Smooth) {
      result.smooth += row(name, rule);
    } else if (rule.cls != RuleClass::NoRule) {
      const bool is_zero = rule.cls == RuleClass::Constant || rule.cls == RuleClass::Blocked;
      std::string& names = by_reason[(is_zero ? "0: " : "") + std::string(rule.convention)];
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

void holds(const std::string& name, const std::string& table) {
  expect_table_in_page(RETROGRADE_TEST_DIR "/../docs/derivatives.md", name, table);
}

TEST(DerivativesPage, holds_the_partials_of_the_rule_table) { holds("partials", tables().smooth); }

TEST(DerivativesPage, holds_the_reasons_of_operators_without_partials) {
  holds("no_partials", tables().others);
}

}  // namespace
}  // namespace retrograde::autodiff
