// buffer_metadata.h -- names of the variables that hold the metadata of a buffer.
//
// In each dimension, a buffer "input" has a min, an extent and a stride. Expressions read them as variables with the
// names "input.min.0", "input.extent.1" and "input.stride.2". A Realize has such variables, too: they are free in its
// body until it becomes an Allocate, when they get values.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::ir {

enum class Metadata : uint8_t { Min, Extent, Stride };
// "min", "extent" or "stride"
const char* to_string(Metadata what);

// "input.extent.1" for Metadata::Extent in dimension 1 of "input"
std::string metadata_name(const std::string& buffer, Metadata what, size_t dimension);
// The names of the min, extent and stride of each dimension.
std::vector<std::string> metadata_names(const std::string& buffer, size_t dimensions);

// The variable of that name.
Expr metadata(const std::string& buffer, Metadata what, size_t dimension);
// The min and extent that a buffer has in a dimension, as variables.
Range metadata_range(const std::string& buffer, size_t dimension);

// The parts of a name of metadata.
struct MetadataName {
  std::string buffer;
  Metadata what;
  size_t dimension;
};
// Takes a name apart; nullopt if it does not have the form of a name of metadata.
std::optional<MetadataName> parse_metadata_name(const std::string& name);

}  // namespace retrograde::ir
