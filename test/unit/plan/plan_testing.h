// Plans of small programs, and their texts without the numbers that make names unique in a process.
#pragma once

#include <gtest/gtest.h>

#include <regex>
#include <string>
#include <vector>

#include "autoschedule/plan/plan.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "graph/directives/schedule_log.h"
#include "graph/directives/wrappers.h"
#include "graph/names.h"

namespace retrograde::planning {

inline std::vector<graph::FuncPtr> functions(const std::vector<Func>& outputs) {
  std::vector<graph::FuncPtr> result;
  for (const Func& f : outputs) result.push_back(f.function());
  return graph::apply_wrappers(result);
}

inline Plan imported(const std::vector<Func>& outputs) { return import_plan(functions(outputs)); }

// The text with the names that Funcs and reduction variables have in this process.
inline std::string with_numbers(const std::string& text, const Program& program) {
  std::string result = text;
  const auto replace = [&](const std::string& name) {
    const std::string plain = graph::without_numbers(name);
    if (plain == name) return;
    const std::regex word("(^|[^A-Za-z_0-9$.])" +
                          std::regex_replace(plain, std::regex("\\."), "\\.") +
                          "(?![A-Za-z_0-9$])");
    result = std::regex_replace(result, word,
                                "$1" + std::regex_replace(name, std::regex("\\$"), "$$$$"));
  };
  for (const graph::FuncPtr& f : program.funcs) {
    replace(f->name);
    for (int s = 0; s < f->stage_count(); ++s) {
      for (const auto& r : f->stage(s).rvars) replace(r.var);
    }
  }
  return result;
}

inline Plan parsed(const std::string& text, const ProgramPtr& program) {
  return parse_plan(with_numbers(text, *program), program);
}
inline Plan parsed(const std::string& text, const std::vector<Func>& outputs) {
  return parsed(text, make_program(functions(outputs)));
}

inline std::string plain_text(const Plan& plan) { return graph::without_numbers(to_text(plan)); }
// The directives that a plan gives to a program without any.
inline std::string emitted_log(const Plan& plan) {
  return graph::without_numbers(graph::schedule_log(emit_plan(plan)).to_text());
}

// Imports the schedule; expects this text, and that text and directives give the plan back.
inline void expect_plan(const std::vector<Func>& outputs, const std::string& expected) {
  const Plan plan = imported(outputs);
  EXPECT_EQ(plain_text(plan), expected);
  EXPECT_TRUE(parse_plan(to_text(plan), plan.program) == plan);
  EXPECT_EQ(to_text(import_plan(emit_plan(plan))), to_text(plan));
}

}  // namespace retrograde::planning
