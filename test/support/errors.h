// Expectations on errors: the class that is thrown, and the phrases of its message.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <string_view>

#include "diagnostics/error.h"

namespace retrograde {

// Returns the message of the Kind that `action` throws; errors about a program must have all four parts. Other
// exceptions propagate.
template <class Kind = CompileError, class Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const Kind& error) {
    const Message& m = error.message();
    const bool is_whole =
        !(m.asked.empty() || m.rule.empty() || m.evidence.empty() || m.instead.empty());
    EXPECT_TRUE(is_whole || !(std::is_same_v<Kind, CompileError>)) << error.what();
    return error.what();
  }
  return "no error";
}

inline void expect_mentions(const std::string& message,
                            std::initializer_list<std::string_view> phrases) {
  for (std::string_view phrase : phrases)
    EXPECT_NE(message.find(phrase), std::string::npos) << "no '" << phrase << "' in: " << message;
}

template <class Kind = CompileError, class Action>
void expect_error(std::initializer_list<std::string_view> phrases, Action&& action) {
  expect_mentions(error_of<Kind>(action), phrases);
}

}  // namespace retrograde
