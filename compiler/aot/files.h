// Files that are written whole or not at all.
#pragma once

#include <string>
#include <vector>

namespace retrograde::aot {

struct File {
  std::string path, contents;
};

// Writes all of them under temporary names beside their places first, then moves each to its
// place. CompileError when one cannot be written: then no place has changed and nothing is left.
void write_files(const std::vector<File>& files);

}  // namespace retrograde::aot
