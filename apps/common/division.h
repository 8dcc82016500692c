// division.h -- which photographs of a folder programs learn from, and which they are measured on.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace apps {

struct Division {
  std::vector<std::filesystem::path> train = {}, held_out = {};
  std::string words;  // who says so
};

// As the folder's photographs.txt says, whose lines are "train FILE" or "held_out FILE"; without one, every fourth by
// name, and the last, are held out. Throws retrograde::UserError unless there is one of either kind at least, and for
// a line that is none. Whether the files of a list are there shows when they are read.
Division division_of(const std::filesystem::path& folder);

}  // namespace apps
