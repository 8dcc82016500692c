// records.h -- what one device gave, bit for bit, in a file: so that two devices can be compared that one
// process cannot have.
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
  std::string bytes;  // of all elements; or why there are none
};

class RecordWriter {
 public:
  explicit RecordWriter(const std::string& path) : out_(path, std::ios::binary) {}
  // It is in the file when this is over, whatever becomes of the process.
  void add(const Record& record);
  bool is_good() const { return out_.good(); }

 private:
  std::ofstream out_;
};

// Those that are whole.
std::vector<Record> read_records(const std::string& path);

struct Agreement {
  size_t compared = 0, refused = 0, bytes = 0;
  std::vector<std::string> problems;  // a line for each
};

// Of what both have by name; what one lacks is no problem, since their time may have been over.
Agreement compare(const std::vector<Record>& device, const std::vector<Record>& executor);

}  // namespace device_check
