#include "records.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <sstream>

namespace device_check {
namespace {

// Format: name, tab, number of the state, tab, number of bytes, newline; then the bytes.
bool read_record(std::istream& in, Record& record) {
  std::string line;
  if (!std::getline(in, line)) return false;
  std::istringstream fields(line);
  int state = 0;
  size_t bytes = 0;
  if (!std::getline(fields, record.name, '\t') || !(fields >> state >> bytes)) return false;
  if (state < 0 || state > static_cast<int>(Record::State::Failed)) return false;
  record.state = static_cast<Record::State>(state);
  record.bytes.resize(bytes);
  return static_cast<bool>(in.read(record.bytes.data(), static_cast<std::streamsize>(bytes)));
}

std::string first_difference(const std::string& a, const std::string& b) {
  if (a.size() != b.size())
    return std::to_string(a.size()) + " bytes, the executor's are " + std::to_string(b.size());
  const auto at =
      static_cast<size_t>(std::mismatch(a.begin(), a.end(), b.begin()).first - a.begin());
  const size_t word = at / 4 * 4;
  size_t words = 0;
  for (size_t i = 0; i + 4 <= a.size(); i += 4) words += std::memcmp(&a[i], &b[i], 4) != 0;
  float got = 0, wanted = 0;
  if (word + 4 <= a.size()) {
    std::memcpy(&got, &a[word], 4);
    std::memcpy(&wanted, &b[word], 4);
  }
  std::ostringstream text;
  text.precision(9);
  text << "byte " << at << " differs, and " << words << " of " << a.size() / 4
       << " words; as float32 it is " << got << ", the executor's is " << wanted;
  return text.str();
}

}  // namespace

void RecordWriter::add(const Record& record) {
  out_ << record.name << '\t' << static_cast<int>(record.state) << '\t' << record.bytes.size()
       << '\n';
  out_.write(record.bytes.data(), static_cast<std::streamsize>(record.bytes.size()));
  out_.flush();
}

std::vector<Record> read_records(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<Record> records;
  for (Record record; read_record(in, record);) records.push_back(record);
  return records;
}

Agreement compare(const std::vector<Record>& device, const std::vector<Record>& executor) {
  std::map<std::string, const Record*> expected;
  for (const Record& record : executor) expected[record.name] = &record;
  Agreement result;
  for (const Record& record : device) {
    const auto found = expected.find(record.name);
    if (found == expected.end()) continue;
    const Record& other = *found->second;
    if (record.state == Record::State::Failed) {
      result.problems.push_back(record.name + " fails on the device: " + record.bytes);
    } else if (other.state == Record::State::Failed) {
      result.problems.push_back(record.name + " fails on the executor: " + other.bytes);
    } else if (record.state != other.state) {
      result.problems.push_back(record.name + " is refused for one device alone: " +
                                (record.state == Record::State::Done ? other : record).bytes);
    } else if (record.state == Record::State::Refused) {
      result.refused++;
    } else {
      result.compared++;
      result.bytes += record.bytes.size();
      if (record.bytes != other.bytes)
        result.problems.push_back(
            record.name + " gives other bits: " + first_difference(record.bytes, other.bytes));
    }
  }
  return result;
}

}  // namespace device_check
