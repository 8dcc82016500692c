// How tools/gpu_check compares the results of two devices.
#include "records.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "child.h"
#include "support/temporary_folder.h"

namespace device_check {
namespace {

using State = Record::State;

TEST(GpuCheckRecords, AreReadAsTheyWereWritten) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "records").string();
  const std::vector<Record> written = {{"a", State::Done, std::string("1\n\0\t4", 5)},
                                       {"b of two words", State::Refused, "a rule"},
                                       {"c", State::Failed, ""}};
  {
    RecordWriter writer(file);
    for (const Record& record : written) writer.add(record);
    EXPECT_TRUE(writer.is_good());
  }
  const std::vector<Record> read = read_records(file);
  ASSERT_EQ(read.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read[i].name, written[i].name);
    EXPECT_EQ(read[i].state, written[i].state);
    EXPECT_EQ(read[i].bytes, written[i].bytes);
  }
  // If a process ends in the middle of a record, the earlier records stay valid.
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 10);
  EXPECT_LT(read_records(file).size(), 3u);
  EXPECT_EQ(read_records(file).at(0).bytes, written[0].bytes);
  EXPECT_TRUE(read_records("/nowhere/records").empty());
}

TEST(GpuCheckRecords, OtherBitsAreAProblemThatIsPointedAt) {
  const float right[] = {1, 2, 3, 4}, wrong[] = {1, 2, 3.5f, 4};
  const auto bytes = [](const float(&values)[4]) {
    return std::string(reinterpret_cast<const char*>(values), sizeof values);
  };
  EXPECT_TRUE(compare({{"f", State::Done, bytes(right)}}, {{"f", State::Done, bytes(right)}})
                  .problems.empty());
  const Agreement found =
      compare({{"f", State::Done, bytes(wrong)}}, {{"f", State::Done, bytes(right)}});
  EXPECT_EQ(found.compared, 1u);
  ASSERT_EQ(found.problems.size(), 1u);
  EXPECT_NE(found.problems[0].find(
                "f gives other bits: byte 10 differs, and 1 of 4 words; as float32 it is 3.5, "
                "the executor's is 3"),
            std::string::npos)
      << found.problems[0];
}

TEST(GpuCheckRecords, FailuresAndOneSidedRefusalsAreProblems) {
  const std::string none;
  const auto problems = [](State device, State executor) {
    return compare({{"f", device, "why"}}, {{"f", executor, "why"}}).problems.size();
  };
  EXPECT_EQ(problems(State::Failed, State::Done), 1u);
  EXPECT_EQ(problems(State::Done, State::Failed), 1u);
  EXPECT_EQ(problems(State::Failed, State::Failed), 1u);
  EXPECT_EQ(problems(State::Refused, State::Done), 1u);
  EXPECT_EQ(problems(State::Done, State::Refused), 1u);
  EXPECT_EQ(problems(State::Refused, State::Refused), 0u);
  EXPECT_EQ(compare({{"f", State::Done, "1"}}, {{"g", State::Done, "2"}}).compared, 0u)
      << "what one alone came to is not compared";
}

TEST(GpuCheckChildren, AreWaitedForAndEndedWhenTheirTimeIsOver) {
  const Ended ended =
      run_child({"sh", "-c", "echo out; echo err >&2; echo $A; exit 3"}, {{"A", "given"}}, 20);
  EXPECT_EQ(ended.status, 3);
  EXPECT_EQ(ended.out, "out\ngiven\n");
  EXPECT_EQ(ended.err, "err\n");
  EXPECT_FALSE(ended.timed_out);
  const Ended late = run_child({"sleep", "60"}, {}, 0.05);
  EXPECT_TRUE(late.timed_out);
  EXPECT_FALSE(late.succeeded());
  EXPECT_FALSE(run_child({"/nowhere/program"}, {}, 1).succeeded());
  EXPECT_NE(find_program("sh"), "");
  EXPECT_EQ(find_program("no-such-program", {"/bin"}), "");
}

}  // namespace
}  // namespace device_check
