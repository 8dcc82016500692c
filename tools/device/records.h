// records.h -- stores the exact results of one device in a file, to compare two devices that one process cannot use
// both.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

namespace device_check {

struct Record {
  enum class State : uint8_t { Done, Refused, Failed };
  std::string name;
  State state = State::Done;
  std::string bytes;  // of all elements, or why there are none
};

class RecordWriter {
 public:
  explicit RecordWriter(const std::string& path) : out_(path, std::ios::binary) {}
  // Flushes the record to the file before returning, so that it survives a crash.
  void add(const Record& record);
  bool is_good() const { return out_.good(); }

 private:
  std::ofstream out_;
};

// The complete records.
std::vector<Record> read_records(const std::string& path);

struct Agreement {
  size_t compared = 0, refused = 0, bytes = 0;
  std::vector<std::string> problems;  // one line each
};

// Compares the records that both have, by name. Missing records are no problem, because a time limit may have ended a
// run.
Agreement compare(const std::vector<Record>& device, const std::vector<Record>& executor);

}  // namespace device_check
