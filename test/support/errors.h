// What is thrown, and whether its message says what it should.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

#include "diagnostics/error.h"

namespace retrograde {

// The message of the Kind that `action` throws; what else it throws goes on.
template <class Kind = UserError, class Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const Kind& error) {
    return error.what();
  }
  return "no error";
}

inline void expect_mentions(const std::string& message,
                            std::initializer_list<const char*> phrases) {
  for (const char* phrase : phrases)
    EXPECT_NE(message.find(phrase), std::string::npos) << "no '" << phrase << "' in: " << message;
}

}  // namespace retrograde
