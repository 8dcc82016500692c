// state.cpp -- see state.h.
//
//   8 bytes magic | u32 version | u64 bytes of the body | body | u32 CRC-32 of all before
//
// The body: program, step, seconds, then words and arrays, each list preceded by its length. Numbers are in the
// processor's byte order, so a state can only be resumed on the same kind of machine.
#include "common/state.h"

#include <array>
#include <cstring>
#include <fstream>
#include <functional>
#include <sstream>

#include "common/files.h"
#include "diagnostics/error.h"

namespace apps {

using retrograde::quoted;
using retrograde::text;

namespace {

constexpr char magic[8] = {'R', 'G', 'S', 'T', 'A', 'T', 'E', '\n'};
constexpr uint32_t state_version = 1;
constexpr size_t head_bytes = sizeof magic + sizeof(uint32_t) + sizeof(uint64_t);

// The CRC of ISO 3309, as in zip and PNG, with the reversed polynomial 0xedb88320.
uint32_t crc32(std::string_view bytes) {
  static const std::array<uint32_t, 256> table = [] {
    std::array<uint32_t, 256> rows{};
    for (uint32_t n = 0; n < 256; ++n) {
      uint32_t c = n;
      for (int k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320u ^ (c >> 1) : c >> 1;
      rows[n] = c;
    }
    return rows;
  }();
  uint32_t crc = ~0u;
  for (const char byte : bytes) crc = table[(crc ^ static_cast<uint8_t>(byte)) & 0xff] ^ (crc >> 8);
  return ~crc;
}

class StateWriter {
 public:
  template <typename T>
  void number(T value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void word(const std::string& word) {
    number<uint64_t>(word.size());
    bytes += word;
  }
  void array(const std::vector<double>& values) {
    number<uint64_t>(values.size());
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
  }

  std::string bytes;
};

// The checksum was right, so the data are our own; lengths are checked nevertheless.
class StateReader {
 public:
  StateReader(std::string_view bytes, std::function<void()> refuse)
      : bytes_(bytes), refuse_(std::move(refuse)) {}

  template <typename T>
  T number() {
    T value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }
  std::string word() {
    const auto size = number<uint64_t>();
    return std::string(take(size), size);
  }
  std::vector<double> array() {
    const auto size = number<uint64_t>();
    if (size > bytes_.size() / sizeof(double)) refuse_();
    std::vector<double> values(size);
    if (size > 0) std::memcpy(values.data(), take(size * sizeof(double)), size * sizeof(double));
    return values;
  }

 private:
  const char* take(uint64_t count) {
    if (count > bytes_.size()) refuse_();
    const char* from = bytes_.data();
    bytes_.remove_prefix(count);
    return from;
  }

  std::string_view bytes_;
  std::function<void()> refuse_;  // throws
};

[[noreturn]] void refuse_state(const std::filesystem::path& path, const std::string& evidence) {
  retrograde::call_error(text("resume from ", quoted(path.string())),
                         "it must be the whole state of an earlier run of this program", evidence,
                         "Run without --resume to begin anew, or give the --output of that run");
}

std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse_state(path, "no such file can be read");
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return std::move(bytes).str();
}

// The body of a file, after checking its head and checksum.
std::string_view checked_body(const std::filesystem::path& path, std::string_view bytes) {
  uint32_t version = 0, crc = 0;
  uint64_t body = 0;
  if (bytes.size() < head_bytes || std::memcmp(bytes.data(), magic, sizeof magic) != 0)
    refuse_state(path, "it does not begin as a state does");
  std::memcpy(&version, bytes.data() + sizeof magic, sizeof version);
  if (version != state_version)
    refuse_state(path, text("it is of version ", version, ", not ", state_version));
  std::memcpy(&body, bytes.data() + sizeof magic + sizeof version, sizeof body);
  const uint64_t there = bytes.size() - head_bytes;
  if (there < sizeof crc || body != there - sizeof crc)
    refuse_state(path, text("it is truncated or has a tail: ", bytes.size(), " bytes, where ", body,
                            " and ", head_bytes + sizeof crc, " were written"));
  std::memcpy(&crc, bytes.data() + head_bytes + body, sizeof crc);
  if (crc != crc32(bytes.substr(0, head_bytes + body)))
    refuse_state(path, "it is damaged: its checksum is wrong");
  return bytes.substr(head_bytes, body);
}

}  // namespace

const std::vector<double>& State::array(const std::string& name, size_t size) const {
  const auto found = arrays.find(name);
  if (found == arrays.end() || found->second.size() != size) {
    retrograde::call_error(
        "resume with these options",
        text("the state must have ", quoted(name), " of ", size, " numbers, as this run has"),
        found == arrays.end() ? std::string("it has none") : text("it has ", found->second.size()),
        "Give the options and inputs of the run that is resumed, or leave out --resume");
  }
  return found->second;
}

void State::put(const std::string& name, std::span<const float> values) {
  arrays[name].assign(values.begin(), values.end());
}

void State::get(const std::string& name, std::span<float> values) const {
  const std::vector<double>& from = array(name, values.size());
  for (size_t n = 0; n < from.size(); ++n) values[n] = static_cast<float>(from[n]);
}

void State::put(const std::string& name, const std::mt19937_64& random) {
  words[name] = text(random);
}

void State::get(const std::string& name, std::mt19937_64& random) const {
  const auto found = words.find(name);
  std::istringstream in(found == words.end() ? std::string() : found->second);
  if (!(in >> random)) {
    retrograde::call_error("resume with these options",
                           text("the state must have the random numbers ", quoted(name)),
                           "it has none", "Leave out --resume");
  }
}

void write_state(const std::filesystem::path& path, const State& state) {
  StateWriter body;
  body.word(state.program);
  body.number<int64_t>(state.step);
  body.number<double>(state.seconds);
  body.number<uint64_t>(state.words.size());
  for (const auto& [name, word] : state.words) {
    body.word(name);
    body.word(word);
  }
  body.number<uint64_t>(state.arrays.size());
  for (const auto& [name, values] : state.arrays) {
    body.word(name);
    body.array(values);
  }
  StateWriter file;
  file.bytes.assign(magic, sizeof magic);
  file.number<uint32_t>(state_version);
  file.number<uint64_t>(body.bytes.size());
  file.bytes += body.bytes;
  file.number<uint32_t>(crc32(file.bytes));
  write_file(path, file.bytes);
}

State read_state(const std::filesystem::path& path, const std::string& program) {
  const std::string bytes = read_bytes(path);
  StateReader in(checked_body(path, bytes), [&] { refuse_state(path, "its lists do not fit"); });
  State state;
  state.program = in.word();
  if (state.program != program) refuse_state(path, text("it is one of ", quoted(state.program)));
  state.step = in.number<int64_t>();
  state.seconds = in.number<double>();
  for (auto left = in.number<uint64_t>(); left > 0; --left) {
    const std::string name = in.word();
    state.words[name] = in.word();
  }
  for (auto left = in.number<uint64_t>(); left > 0; --left) {
    const std::string name = in.word();
    state.arrays[name] = in.array();
  }
  return state;
}

void require_same_problem(const std::filesystem::path& path, const State& state,
                          const std::string& problem, const std::string& kind) {
  const auto before = state.words.find("problem");
  if (before != state.words.end() && before->second == problem) return;
  retrograde::call_error(
      text("go on with ", quoted(path.string())),
      text("a run goes on with ", kind, " it began with"),
      text("it began with ", before == state.words.end() ? "nothing" : before->second, "; this is ",
           problem),
      "Give the same options, or leave --resume out");
}

}  // namespace apps
