// Checks that a program breaks a rule: the kind of its error, words of its rule, and that the
// message has all four parts.
#pragma once

#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <functional>
#include <string>

namespace retrograde {

struct Rules : testing::Test {
  Var x{"x"}, y{"y"}, z{"z"};
  Func f{"f"}, two{"two"};
  Rules() {
    f(x, y) = x + y;
    two(x) = Tuple(x, x + 1);
  }

  template <typename Kind = CompileError>
  static void expect(const std::string& rule, const std::function<void()>& program) {
    try {
      program();
      ADD_FAILURE() << "no error: " << rule;
    } catch (const Kind& error) {
      EXPECT_NE(error.message().rule.find(rule), std::string::npos) << "\"" << rule << "\" in\n"
                                                                    << error.what();
      EXPECT_FALSE(error.message().evidence.empty()) << error.what();
      EXPECT_FALSE(error.message().instead.empty()) << error.what();
    } catch (const std::exception& error) {
      ADD_FAILURE() << "another kind of error: " << error.what();
    }
  }
};

}  // namespace retrograde
