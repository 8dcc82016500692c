// Tests how photographs are divided into those for learning and the others: by a list, or by name.
#include "common/division.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/files.h"
#include "common/images.h"
#include "diagnostics/error.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

class AppDivision : public testing::Test {
 protected:
  void add(const std::vector<std::string>& names) {
    for (const std::string& name : names) apps::write_image(folder_ / name, {1, 1, 8, {0, 0, 0}});
  }
  void list(const std::string& text) { apps::write_file(folder_ / "photographs.txt", text); }
  std::vector<fs::path> paths(const std::vector<std::string>& names) const {
    std::vector<fs::path> result;
    for (const std::string& name : names) result.push_back(folder_ / name);
    return result;
  }
  void expect_refused(const std::string& part) {
    try {
      apps::division_of(folder_);
      FAIL() << "divided";
    } catch (const retrograde::UserError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(AppDivision, HoldsOutEveryFourthAndTheLast) {
  add({"f.png", "a.png", "b.png", "c.png", "d.png", "e.png"});
  const apps::Division division = apps::division_of(folder_);
  EXPECT_EQ(division.train, paths({"a.png", "b.png", "c.png", "e.png"}));
  EXPECT_EQ(division.held_out, paths({"d.png", "f.png"}));
  EXPECT_NE(division.words.find("every fourth"), std::string::npos);
}

TEST_F(AppDivision, IsAsTheListSays) {
  add({"a.png", "b.png", "c.png"});
  list("# of two\n\nheld_out a.png  # the portrait\ntrain c.png\n");
  const apps::Division division = apps::division_of(folder_);
  EXPECT_EQ(division.train, paths({"c.png"}));
  EXPECT_EQ(division.held_out, paths({"a.png"}));
  EXPECT_NE(division.words.find("photographs.txt"), std::string::npos);
}

TEST_F(AppDivision, RefusesLinesThatAreNone) {
  add({"a.png", "b.png"});
  list("train a.png\nlearn b.png\n");
  expect_refused("it has the line \"learn b.png\"");
  list("train a.png\nheld_out\n");
  expect_refused("it has the line \"held_out\"");
}

TEST_F(AppDivision, NeedsOneOfEither) {
  add({"a.png"});
  expect_refused("there are 0 to learn from and 1 to measure on");
  list("train a.png\n");
  expect_refused("there are 1 to learn from and 0 to measure on");
}

}  // namespace
