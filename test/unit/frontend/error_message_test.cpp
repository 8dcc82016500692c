// The four parts of a message, their rendering, and the class that each helper throws.
#include <gtest/gtest.h>

#include <type_traits>

#include "diagnostics/error.h"
#include "support/errors.h"

namespace retrograde {
namespace {

TEST(Messages, ListsHaveCommas) {
  const std::vector<std::string> names = {"x", "y"};
  EXPECT_EQ(listed(names), "x, y");
  EXPECT_EQ(listed(names, quoted), "\"x\", \"y\"");
  EXPECT_EQ(listed(std::vector<std::string>()), "");
}

TEST(Message, RendersAllFourParts) {
  const Message message{"vectorize \"blur_x\" over \"r\"",
                        "iterations of a vectorized loop must be independent",
                        "its update definition reads \"blur_x\"(r - 1)", "vectorize \"x\" instead"};
  EXPECT_EQ(message.render(),
            "cannot vectorize \"blur_x\" over \"r\": iterations of a vectorized loop must be "
            "independent; its update definition reads \"blur_x\"(r - 1). Vectorize \"x\" instead.");
}

TEST(Message, LeavesOutMissingParts) {
  EXPECT_EQ((Message{"realize \"f\"", "it has no definition", "", ""}.render()),
            "cannot realize \"f\": it has no definition.");
}

TEST(Message, KeepsAFinalStopSingle) {
  EXPECT_EQ((Message{"do this", "it breaks a rule.", "", "Do that."}.render()),
            "cannot do this: it breaks a rule. Do that.");
}

TEST(Error, UserErrorHelperThrowsCompileErrorWithItsParts) {
  try {
    user_error("split \"x\"", "the factor must be positive", "it is 0",
               "use a factor of 1 or more");
    FAIL() << "nothing was thrown";
  } catch (const CompileError& error) {
    EXPECT_EQ(error.message().asked, "split \"x\"");
    EXPECT_EQ(error.message().evidence, "it is 0");
    EXPECT_STREQ(error.what(),
                 "cannot split \"x\": the factor must be positive; it is 0. Use a factor of 1 or "
                 "more.");
  }
}

TEST(Error, CallErrorHelperThrowsRuntimeErrorWithItsCode) {
  try {
    call_error("call \"f\"", "an argument is null", "argument \"in\"", "", -12);
    FAIL() << "nothing was thrown";
  } catch (const RuntimeError& error) {
    EXPECT_EQ(error.code(), -12);
  }
}

TEST(Error, ClassesAreToldApart) {
  EXPECT_THROW(user_error("a", "b"), UserError);
  EXPECT_THROW(call_error("a", "b"), UserError);
  EXPECT_THROW(unsupported("a", "b"), Unsupported);
  EXPECT_THROW(internal_error("a"), InternalError);
  static_assert(!std::is_base_of_v<UserError, Unsupported>, "a known gap is not the user's error");
}

TEST(InternalError, AssertShowsConditionPartsAndPlace) {
  const int extent = -1;
  try {
    RETROGRADE_ASSERT(extent >= 0, "extent of ", quoted("x"), " is ", extent);
    FAIL() << "nothing was thrown";
  } catch (const InternalError& error) {
    const std::string what = error.what();
    expect_mentions(what,
                    {"expected extent >= 0: extent of \"x\" is -1", "error_message_test.cpp:"});
  }
}

TEST(InternalError, AssertIsSilentWhenTheConditionHolds) {
  EXPECT_NO_THROW(RETROGRADE_ASSERT(1 + 1 == 2, "arithmetic"));
  EXPECT_NO_THROW(RETROGRADE_ASSERT(true));
  EXPECT_NO_THROW(internal_assert(true, "never"));
  EXPECT_THROW(internal_assert(false, "always"), InternalError);
}

TEST(InternalError, CarriesPassAndProgram) {
  const InternalError error("a store left its region", "fold_storage", "for x in [0, 4): ...");
  const std::string what = error.what();
  EXPECT_EQ(error.pass(), "fold_storage");
  expect_mentions(what, {"in pass \"fold_storage\"", "for x in [0, 4): ..."});
}

}  // namespace
}  // namespace retrograde
