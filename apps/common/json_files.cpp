// json_files.cpp -- see json_files.h.
#include "common/json_files.h"

#include <cstdint>
#include <fstream>
#include <iterator>

#include "diagnostics/error.h"

namespace apps {

using retrograde::text;

namespace {

constexpr std::uintmax_t most_bytes = 64 << 20;
constexpr size_t most_shown = 200;

// Length in bytes of the character at this position; 0 if there is none (RFC 3629, section 4).
size_t length_of_character(std::string_view bytes) {
  const auto at = [&](size_t n) {
    return n < bytes.size() ? static_cast<unsigned char>(bytes[n]) : 0u;
  };
  const unsigned first = at(0);
  if (first < 0x80) return 1;
  const size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || bytes.size() < length) return 0;
  for (size_t n = 1; n < length; ++n) {
    if ((at(n) & 0xc0) != 0x80) return 0;
  }
  const bool is_long = (first == 0xe0 && at(1) < 0xa0) || (first == 0xf0 && at(1) < 0x90);
  const bool is_none = (first == 0xed && at(1) > 0x9f) || (first == 0xf4 && at(1) > 0x8f);
  return is_long || is_none ? 0 : length;
}

bool is_control(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  if (character.size() == 2)
    return first == 0xc2 && static_cast<unsigned char>(character[1]) < 0xa0;
  if (first == '\t' || first == '\n' || first == '\r') return false;
  return first < 0x20 || first == 0x7f;
}

// The index of the first byte that is not text, or the size.
size_t end_of_text(std::string_view bytes) {
  size_t n = 0;
  while (n < bytes.size()) {
    const size_t length = length_of_character(bytes.substr(n));
    if (length == 0 || is_control(bytes.substr(n, length))) break;
    n += length;
  }
  return n;
}

// Reads up to a limit, because some files (such as devices) never end.
std::string bytes_of(std::ifstream& file) {
  std::string bytes;
  std::istreambuf_iterator<char> from(file), end;
  for (; from != end && bytes.size() <= most_bytes; ++from) bytes += *from;
  return bytes;
}

}  // namespace

bool is_text(std::string_view bytes) { return end_of_text(bytes) == bytes.size(); }

std::string read_json(const std::filesystem::path& path, nlohmann::json& to) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return "it is a folder";
  std::ifstream file(path, std::ios::binary);
  if (!file) return "no such file can be read";
  const std::string bytes = bytes_of(file);
  if (bytes.size() > most_bytes) return text("it has more than ", most_bytes, " bytes");
  if (const size_t end = end_of_text(bytes); end < bytes.size())
    return text("it is a binary file: byte ", end + 1, " is not text");
  try {
    to = nlohmann::json::parse(bytes);
  } catch (const nlohmann::json::exception& error) {
    const std::string said = error.what();
    return said.size() <= most_shown ? said : said.substr(0, said.rfind(';', most_shown));
  }
  return {};
}

}  // namespace apps
