// The disk cache of compiled functions: entries are reused in later runs, but never when they
// differ from what was written.
#include "jit/disk_cache.h"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "diagnostics/error.h"
#include "frontend/run/compile_cache.h"
#include "support/errors.h"
#include "support/temporary_folder.h"
#include "unit/codegen/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

namespace fs = std::filesystem;

LoweredFunction scaled(int factor, const std::string& suffix = "") {
  LoweredFunction f;
  f.name = "scaled" + suffix;
  f.args = {output("out" + suffix, Int(32))};
  const Expr x = variable("x" + suffix);
  f.body =
      make_for("x" + suffix, 0, 16, ForType::Serial, make_store("out" + suffix, x * factor, x));
  return f;
}

class DiskCache : public testing::Test {
 protected:
  ~DiskCache() override { set_compile_cache_directory(""); }
  std::string folder(const std::string& name = "cache") const { return root / name; }

  // Imitates a later run of the program: only the disk contents remain.
  static void start_again(const std::string& where) {
    jit::clear_cache();
    set_compile_cache_directory(where);
  }
  static void expect_runs(const LoweredFunction& function, int factor) {
    std::vector<int32_t> out(16);
    halide_dimension_t dim(0, 16, 1);
    halide_buffer_t buffer = {};
    buffer.host = reinterpret_cast<uint8_t*>(out.data());
    buffer.type = halide_type_of<int32_t>();
    buffer.dimensions = 1;
    buffer.dim = &dim;
    void* args[] = {&buffer};
    compile_test(function)->run(args);
    for (int i = 0; i < 16; i++) ASSERT_EQ(out[static_cast<size_t>(i)], i * factor);
  }
  static jit::DiskCacheStatistics statistics() { return jit::disk_cache()->statistics(); }
  std::vector<fs::path> entries(const std::string& where) const {
    std::vector<fs::path> result;
    for (const auto& entry : fs::directory_iterator(where)) {
      if (entry.path().filename().string().size() == 64) result.push_back(entry.path());
    }
    std::sort(result.begin(), result.end());
    return result;
  }
  static std::string read_file(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // Writes in place, so the file mode is unchanged.
  static void write_file(const fs::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
  }
  // Expects that the entry existed, was not used, and was replaced by a valid one.
  void expect_rebuilt() {
    start_again(folder());
    expect_runs(scaled(3), 3);
    EXPECT_EQ(statistics().hits, 0u);
    EXPECT_EQ(statistics().rejected, 1u);
    start_again(folder());
    expect_runs(scaled(3), 3);
    EXPECT_EQ(statistics().hits, 1u);
  }
  void write_entry() {
    start_again(folder());
    expect_runs(scaled(3), 3);
  }

  const TemporaryFolder temporary;
  const fs::path& root = temporary.path();
};

// Must be the first test in this file: the environment is read once.
TEST_F(DiskCache, TheEnvironmentNamesAFolder) {
  setenv("RETROGRADE_CACHE_DIR", folder().c_str(), 1);
  jit::clear_cache();
  for (const char* size : {"many", "0", "-3", "5 MB"}) {
    setenv("RETROGRADE_CACHE_MB", size, 1);
    EXPECT_THROW(jit::disk_cache(), UserError) << size;
  }
  setenv("RETROGRADE_CACHE_MB", "5", 1);
  expect_runs(scaled(7), 7);
  unsetenv("RETROGRADE_CACHE_MB");
  EXPECT_EQ(entries(folder()).size(), 1u);
  unsetenv("RETROGRADE_CACHE_DIR");
}

TEST_F(DiskCache, IsOffUntilAFolderIsNamed) {
  start_again("");
  expect_runs(scaled(3), 3);
  EXPECT_EQ(jit::disk_cache(), nullptr);
  EXPECT_TRUE(fs::is_empty(root));
}

TEST_F(DiskCache, ALaterRunTakesWhatAnEarlierOneCompiled) {
  start_again(folder());
  expect_runs(scaled(3), 3);
  EXPECT_EQ(statistics().written, 1u);
  start_again(folder());
  expect_runs(scaled(3), 3);
  EXPECT_EQ(statistics().hits, 1u);
  EXPECT_EQ(statistics().written, 0u);
}

TEST_F(DiskCache, NamesDoNotMatter) {
  start_again(folder());
  expect_runs(scaled(3, "$1"), 3);
  start_again(folder());
  expect_runs(scaled(3, "$2"), 3);
  EXPECT_EQ(statistics().hits, 1u);
}

TEST_F(DiskCache, WhatMachineCodeDependsOnIsInTheKey) {
  codegen::Options options;
  const std::string key = jit::disk_cache_key(scaled(3), options);
  EXPECT_EQ(key.size(), 64u);
  EXPECT_EQ(jit::disk_cache_key(scaled(3), options), key);
  EXPECT_NE(jit::disk_cache_key(scaled(4), options), key);
  codegen::Options other = options;
  other.optimization_level = 0;
  EXPECT_NE(jit::disk_cache_key(scaled(3), other), key);
  other = options;
  other.target = Target("arm-64-linux");
  EXPECT_NE(jit::disk_cache_key(scaled(3), other), key);
  other = options;
  other.target = options.target.with_feature(Target::StrictFloat);
  EXPECT_NE(jit::disk_cache_key(scaled(3), other), key);
}

TEST_F(DiskCache, EverythingIsPrivate) {
  write_entry();
  struct stat status;
  ASSERT_EQ(stat(folder().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0700u);
  int files = 0;
  for (const auto& entry : fs::directory_iterator(folder())) {
    ASSERT_EQ(stat(entry.path().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 07777, 0600u) << entry.path();
    files++;
  }
  EXPECT_EQ(files, 2);  // the key and the entry; no unfinished files
}

// ---- modified entries ----

TEST_F(DiskCache, ATruncatedEntryIsRebuilt) {
  write_entry();
  const fs::path entry = entries(folder()).at(0);
  const std::string whole = read_file(entry);
  for (const size_t size : {size_t{0}, size_t{7}, size_t{40}, whole.size() / 2, whole.size() - 1}) {
    write_file(entry, whole.substr(0, size));
    expect_rebuilt();
  }
}

TEST_F(DiskCache, AChangedEntryIsRebuilt) {
  write_entry();
  const fs::path entry = entries(folder()).at(0);
  const std::string whole = read_file(entry);
  for (size_t i = 0; i < 16; i++) {
    std::string changed = whole;
    changed[i * (whole.size() - 1) / 15] ^= 1;
    write_file(entry, changed);
    expect_rebuilt();
  }
  write_file(entry, whole + "x");
  expect_rebuilt();
}

TEST_F(DiskCache, AnEntryOfAnotherProgramIsRebuilt) {
  write_entry();
  const fs::path mine = entries(folder()).at(0);
  expect_runs(scaled(4), 4);
  for (const fs::path& entry : entries(folder())) {
    if (entry != mine) write_file(mine, read_file(entry));
  }
  expect_rebuilt();
}

TEST_F(DiskCache, AnEntryMadeInAnotherFolderIsRebuilt) {
  write_entry();
  start_again(folder("theirs"));
  expect_runs(scaled(3), 3);
  const fs::path mine = entries(folder()).at(0), theirs = entries(folder("theirs")).at(0);
  EXPECT_EQ(mine.filename(), theirs.filename());
  write_file(mine, read_file(theirs));
  expect_rebuilt();
}

TEST_F(DiskCache, AnEntryThatOthersCouldHaveChangedIsRebuilt) {
  write_entry();
  fs::permissions(entries(folder()).at(0), fs::perms::others_write, fs::perm_options::add);
  expect_rebuilt();
}

TEST_F(DiskCache, ALinkIsNotFollowed) {
  write_entry();
  const fs::path entry = entries(folder()).at(0);
  fs::rename(entry, root / "elsewhere");
  fs::create_symlink(root / "elsewhere", entry);
  expect_rebuilt();
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(entry)));
}

TEST_F(DiskCache, ALostKeyMeansRebuilding) {
  write_entry();
  fs::remove(folder() + "/key");
  expect_rebuilt();
}

// ---- folders that are rejected ----

void expect_refused(const std::string& path, const std::string& why) {
  try {
    set_compile_cache_directory(path);
    FAIL() << "was accepted";
  } catch (const CompileError& e) {
    expect_mentions(e.what(), {"belongs to the user alone", why});
  }
}

TEST_F(DiskCache, AFolderThatOthersCanWriteIsRefused) {
  fs::create_directory(folder());
  for (const int mode : {0777, 0720, 0702, 0755}) {
    fs::permissions(folder(), static_cast<fs::perms>(mode));
    expect_refused(folder(), "others can read or write it");
  }
  fs::permissions(folder(), fs::perms::owner_all);
  set_compile_cache_directory(folder());
}

TEST_F(DiskCache, ALinkToAFolderIsRefused) {
  fs::create_directory(folder());
  fs::permissions(folder(), fs::perms::owner_all);
  fs::create_symlink(folder(), folder("link"));
  expect_refused(folder("link"), "cannot be opened");
}

TEST_F(DiskCache, AFolderThatCannotBeMadeIsRefused) {
  expect_refused(folder("no/such"), "cannot be made");
  write_file(folder("file"), "x");
  expect_refused(folder("file"), "cannot be opened");
}

// ---- concurrent processes ----

// ---- size ----

TEST_F(DiskCache, WhatWasNotUsedForLongestGoesFirst) {
  start_again(folder());
  expect_runs(scaled(3), 3);
  const auto one = static_cast<int64_t>(fs::file_size(entries(folder()).at(0)));
  const auto start_small = [&] {
    jit::clear_cache();
    set_compile_cache_directory(folder(), 4 * one + one / 2);
  };
  // File timestamps are coarse, so this sets them hours back.
  const auto age = [&](int hours) {
    const auto now = fs::file_time_type::clock::now();
    for (const fs::path& entry : entries(folder())) {
      if (now - fs::last_write_time(entry) < std::chrono::minutes(30))
        fs::last_write_time(entry, now - std::chrono::hours(hours));
    }
  };
  age(3);
  expect_runs(scaled(4), 4);
  age(2);
  expect_runs(scaled(5), 5);
  age(1);
  // 3 is the oldest entry, and is then used again.
  start_small();
  expect_runs(scaled(3), 3);
  EXPECT_EQ(statistics().hits, 1u);
  for (const int factor : {6, 7}) expect_runs(scaled(factor), factor);
  EXPECT_GE(statistics().removed, 1u);
  EXPECT_LE(entries(folder()).size(), 4u);
  start_small();
  for (const int factor : {3, 7}) expect_runs(scaled(factor), factor);
  EXPECT_EQ(statistics().hits, 2u);
  expect_runs(scaled(4), 4);
  EXPECT_EQ(statistics().misses, 1u);
}

TEST_F(DiskCache, AnEntryLargerThanTheFolderMayBeIsNotKept) {
  set_compile_cache_directory(folder(), 100);
  expect_runs(scaled(3), 3);
  EXPECT_TRUE(entries(folder()).empty());
  EXPECT_EQ(statistics().written, 0u);
}

TEST_F(DiskCache, WhatAWriterLeftHalfDoneIsRemovedInTime) {
  start_again(folder());
  const fs::path left = fs::path(folder()) / "tmp.1.0";
  write_file(left, std::string(5000000, 'x'));
  fs::last_write_time(left, fs::file_time_type::clock::now() - std::chrono::hours(2));
  jit::clear_cache();
  set_compile_cache_directory(folder(), 1000000);
  expect_runs(scaled(3), 3);
  EXPECT_FALSE(fs::exists(left));
  EXPECT_EQ(entries(folder()).size(), 1u);
  EXPECT_TRUE(fs::exists(fs::path(folder()) / "key"));
}

TEST_F(DiskCache, ItsSizeIsPositive) {
  for (const int64_t bytes : {int64_t{0}, int64_t{-5}}) {
    expect_error<UserError>({"its size in bytes is positive"},
                            [&] { set_compile_cache_directory(folder(), bytes); });
  }
}

TEST_F(DiskCache, SeveralWritersLeaveWholeEntries) {
  fs::create_directory(folder());
  fs::permissions(folder(), fs::perms::owner_all);
  const jit::CachedObject object{"f", std::vector<uint8_t>(100000, 7)};
  const std::string key(64, 'a');
  std::vector<std::thread> threads;
  std::atomic<int> torn{0};
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([&] {
      const auto cache = jit::open_disk_cache(
          folder(), default_compile_cache_bytes);  // each as a process of its own
      for (int i = 0; i < 20; i++) {
        cache->insert(key, object);
        const auto found = cache->find(key);
        if (!found || found->object != object.object) torn++;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(torn, 0);
}

}  // namespace
}  // namespace retrograde::testing_codegen
