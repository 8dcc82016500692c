// division.h -- divides the photographs of a folder into training and held-out ones.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace apps {

struct Division {
  std::vector<std::filesystem::path> train = {}, held_out = {};
  std::string words;  // the source of the division, in words
};

// Follows the folder's photographs.txt, with lines "train FILE" or "held_out FILE". Without that file, every fourth
// photograph by name and the last one are held out. Throws retrograde::UserError if either set is empty or a line is
// malformed. Whether the listed files exist is only checked when they are read.
Division division_of(const std::filesystem::path& folder);

}  // namespace apps
