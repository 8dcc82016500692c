// Checks tables of pages in docs/ that tests generate from the code itself, so that the pages cannot disagree with the
// code. The prose around them lives in the page: a table stands between the lines "<!-- table: NAME -->" and "<!-- end
// of table -->". RETROGRADE_UPDATE_GOLDEN=1 writes the tables; read the difference before you commit it.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

namespace retrograde {

// Expects that the page contains this table under this name.
inline void expect_table_in_page(const std::string& path, const std::string& name,
                                 const std::string& table) {
  std::ifstream file(path);
  std::string page{std::istreambuf_iterator<char>(file), {}};
  const std::string opening = "<!-- table: " + name + " -->\n", closing = "<!-- end of table -->\n";
  const size_t at = page.find(opening);
  ASSERT_NE(at, std::string::npos) << path << " has no line " << opening;
  const size_t begin = at + opening.size(), end = page.find(closing, begin);
  ASSERT_NE(end, std::string::npos) << path << " has no line " << closing << " below " << opening;
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) {
    std::ofstream(path) << page.replace(begin, end - begin, table);
    return;
  }
  EXPECT_EQ(page.substr(begin, end - begin), table) << "RETROGRADE_UPDATE_GOLDEN=1 writes " << path;
}

}  // namespace retrograde
