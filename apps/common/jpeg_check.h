// jpeg_check.h -- detects truncated or damaged JPEG files.
//
// Decoders fill the missing part of a truncated file with grey, and report only a warning, which OpenImageIO does not
// pass on. So the file is decoded once more at an eighth of its size, which costs little beyond parsing its codes.
#pragma once

#include <filesystem>
#include <string>

namespace apps {

// The decoder's message about damage in a JPEG file; empty if there is none.
std::string jpeg_damage(const std::filesystem::path& path);

}  // namespace apps
