// Expectations on the facts that explanations() and costs() report: which there are, and their whole texts.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "autodiff/report/explain.h"
#include "graph/names.h"

namespace retrograde {

using Fact = Explanation::Kind;

// The texts of the facts of one kind, in order: about a Func, buffer or parameter, or about all if there is no name.
// Names in them are without their numbers.
inline std::vector<std::string> details_of(const std::vector<Explanation>& facts, Fact kind,
                                           const std::string& subject = "") {
  std::vector<std::string> details;
  for (const Explanation& fact : facts) {
    if (fact.kind == kind && (subject.empty() || fact.subject == subject))
      details.push_back(graph::without_numbers(fact.detail));
  }
  return details;
}

// One of the facts has exactly this text; names in it have their numbers, or none has.
inline void expect_fact(const std::vector<Explanation>& facts, Fact kind,
                        const std::string& subject, const std::string& detail) {
  const bool found = std::ranges::any_of(facts, [&](const Explanation& fact) {
    return fact.kind == kind && fact.subject == subject &&
           (fact.detail == detail || graph::without_numbers(fact.detail) == detail);
  });
  EXPECT_TRUE(found) << to_string(kind) << " \"" << subject << "\": " << detail << "\nis not in\n"
                     << to_string(facts);
}

}  // namespace retrograde
