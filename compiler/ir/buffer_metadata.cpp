#include "ir/buffer_metadata.h"

#include <charconv>
#include <string_view>

#include "ir/build.h"

namespace retrograde::ir {

namespace {

constexpr Metadata all_metadata[] = {Metadata::Min, Metadata::Extent, Metadata::Stride};

std::optional<Metadata> parse_metadata(std::string_view word) {
  for (const Metadata what : all_metadata) {
    if (word == to_string(what)) return what;
  }
  return std::nullopt;
}

// The number that consists of all these digits.
std::optional<size_t> parse_number(std::string_view digits) {
  size_t number = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, number);
  if (error != std::errc() || stop != end) return std::nullopt;
  return number;
}

}  // namespace

const char* to_string(Metadata what) {
  static constexpr const char* words[] = {"min", "extent", "stride"};
  return words[static_cast<int>(what)];
}

std::string metadata_name(const std::string& buffer, Metadata what, size_t dimension) {
  return buffer + "." + to_string(what) + "." + std::to_string(dimension);
}

std::vector<std::string> metadata_names(const std::string& buffer, size_t dimensions) {
  std::vector<std::string> names;
  for (size_t d = 0; d < dimensions; d++) {
    for (const Metadata what : all_metadata) names.push_back(metadata_name(buffer, what, d));
  }
  return names;
}

Expr metadata(const std::string& buffer, Metadata what, size_t dimension) {
  return variable(metadata_name(buffer, what, dimension));
}

Range metadata_range(const std::string& buffer, size_t dimension) {
  return {metadata(buffer, Metadata::Min, dimension),
          metadata(buffer, Metadata::Extent, dimension)};
}

std::optional<MetadataName> parse_metadata_name(const std::string& name) {
  const size_t last = name.rfind('.');
  if (last == std::string::npos || last == 0) return std::nullopt;
  const auto dimension = parse_number(std::string_view(name).substr(last + 1));
  const size_t first = name.rfind('.', last - 1);
  if (!dimension || first == std::string::npos) return std::nullopt;
  const auto what = parse_metadata(std::string_view(name).substr(first + 1, last - first - 1));
  if (!what) return std::nullopt;
  return MetadataName{name.substr(0, first), *what, *dimension};
}

}  // namespace retrograde::ir
