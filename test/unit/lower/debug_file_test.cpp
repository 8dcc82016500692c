// debug_to_file: writes the values of a Func to a file.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>

#include "frontend/include/retrograde/retrograde.h"
#include "support/errors.h"

namespace retrograde {
namespace {

std::string contents(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

template <typename T>
T at(const std::string& bytes, size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

void run(const std::string& path) {
  Var x("x"), y("y");
  Func f("f"), out("out");
  f(x, y) = cast<int16_t>(10 * x + y);
  out(x, y) = f(x, y) + f(x + 1, y);
  f.compute_root().reorder_storage(y, x);
  f.debug_to_file(path);
  out.realize({3, 2});
}

TEST(DebugToFile, TmpHasExtentsTypeAndElements) {
  const std::string path = testing::TempDir() + "debug_file_test.tmp";
  run(path);
  const std::string bytes = contents(path);
  ASSERT_EQ(bytes.size(), 20u + 4 * 2 * 2);
  const int32_t header[5] = {4, 2, 1, 1, 5};
  for (size_t i = 0; i < 5; i++) EXPECT_EQ(at<int32_t>(bytes, 4 * i), header[i]);
  for (int y = 0; y < 2; y++) {
    for (int x = 0; x < 4; x++)
      EXPECT_EQ(at<int16_t>(bytes, 20 + 2 * static_cast<size_t>(x + 4 * y)), 10 * x + y);
  }
  std::remove(path.c_str());
}

TEST(DebugToFile, NpyIsNumPys) {
  const std::string path = testing::TempDir() + "debug_file_test.npy";
  run(path);
  const std::string bytes = contents(path);
  ASSERT_GE(bytes.size(), 64u + 16);
  EXPECT_EQ(bytes.substr(1, 5), "NUMPY");
  expect_mentions(bytes, {"'descr': '<i2', 'fortran_order': True, 'shape': (4,2,)"});
  EXPECT_EQ((bytes.size() - 16) % 64, 0u);
  EXPECT_EQ(at<int16_t>(bytes, bytes.size() - 2), 31);
  std::remove(path.c_str());
}

TEST(DebugToFile, AnUnwritablePathIsAnError) {
  try {
    run("/no such folder/file.tmp");
    FAIL() << "no error";
  } catch (const RuntimeError& error) {
    EXPECT_EQ(error.code(), -13);
    expect_mentions(error.what(), {"/no such folder/file.tmp"});
  }
}

TEST(DebugToFile, FormatsThatCannotBeWrittenAreRefused) {
  for (const char* name : {"f.tiff", "f.mat", "f"}) EXPECT_THROW(run(name), Unsupported) << name;
}

TEST(DebugToFile, TuplesAreRefused) {
  Var x("x");
  Func pair("debugged_pair"), out("out");
  pair(x) = Tuple(x, 2 * x);
  out(x) = pair(x)[0] + pair(x)[1];
  pair.compute_root().debug_to_file("pair.npy");
  expect_error<Unsupported>(
      {"write \"debugged_pair\" to the file \"pair.npy\"", "one value of each point",
       "\"debugged_pair\" has 2", "one element of the Tuple"},
      [&] { out.realize({4}); });
}

TEST(DebugToFile, TypesThatTheFormatsLackAreRefused) {
  Var x("x");
  Func half("half"), out("out");
  half(x) = cast(Float(16), x);
  out(x) = cast<float>(half(x));
  half.compute_root().debug_to_file("half.npy");
  expect_error<Unsupported>({"write \"half\" to the file \"half.npy\"", "the type of the elements",
                             "of type float16", "Cast them to float"},
                            [&] { out.realize({4}); });
}

}  // namespace
}  // namespace retrograde
