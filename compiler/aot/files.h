// Writes files atomically: each is written completely or not at all.
#pragma once

#include <string>
#include <vector>

namespace retrograde::aot {

struct File {
  std::string path, contents;
};

// First writes all files under temporary names beside their destinations, then renames each to its destination. If a
// file cannot be written, throws CompileError; no destination has changed and no temporary file is left.
void write_files(const std::vector<File>& files);

}  // namespace retrograde::aot
